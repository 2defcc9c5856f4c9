use lab_engine::Flight;
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
#[test]
fn try_it() {
    let var = |k: &str| std::env::var(k).unwrap_or_default();
    let Ok(file) = std::env::var("TRY_SCENARIO") else { return };
    let text = std::fs::read_to_string(&file).unwrap();
    let airframe = Some(var("TRY_AIRCRAFT")).filter(|a| !a.is_empty()).map(Into::into);
    let aircraft = AircraftArgs { airframe, ..AircraftArgs::default() };
    let mut options = SetupOptions { aircraft, ..SetupOptions::default() };
    for set in var("TRY_SET").split(',').filter(|s| !s.is_empty()) {
        let (key, value) = set.split_once('=').unwrap();
        let _ = options.set(key, value.parse::<f64>().unwrap());
    }
    let setup = options.builder().unwrap().setup(&Named::given("try", text), &[]).unwrap();
    let mut flight = Flight::new(&setup).unwrap();
    let every: f64 = var("TRY_EVERY").parse().unwrap_or(1.0);
    let from: f64 = var("TRY_FROM").parse().unwrap_or(0.0);
    let to: f64 = var("TRY_TO").parse().unwrap_or(1.0e9);
    let mut next = from;
    while let Some(tick) = flight.step([]) {
        for e in tick.events {
            eprintln!("{:8.3} EVENT {:?}", e.time.as_seconds(), e.kind);
        }
        let t = tick.exchange.time.as_seconds();
        if tick.events.iter().any(|e| {
            matches!(
                e.kind,
                autopilot::event::EventKind::Vehicle(autopilot::vehicle::VehicleEvent::Armed(
                    false
                ))
            )
        }) {
            break;
        }
        if t >= next && t <= to {
            next += every;
            let (s, tr) = (&tick.log.state, tick.plant.truth());
            let (ea, et) = (s.attitude, tr.euler());
            eprintln!(
                "{t:7.2} {} wh{} h={:?} alt={:.1}/{:.1} ref={:.1} V={:.1}/{:.1} gs={:.1} sink={:.2} th={:.1}/{:.1} phi={:.1}/{:.1} psi={:.1}/{:.1} a={:.1} T={:.0} nz={:.2} de={:.1} nzl={:.1} rud={:.1} br={:.1} n={:.0} e={:.0} lvl={:.2}",
                tick.snapshot.mode,
                u8::from(s.on_wheels),
                s.height_above_ground_m.map(|h| (h * 100.0).round() / 100.0),
                s.altitude_m,
                tr.altitude_m,
                tick.snapshot.demand.altitude_m,
                s.airspeed_m_s,
                tr.airspeed_m_s,
                tr.velocity.0.xy().norm(),
                tr.velocity.0.z,
                ea.theta.to_degrees(),
                et.theta.to_degrees(),
                ea.phi.to_degrees(),
                et.phi.to_degrees(),
                ea.psi.to_degrees(),
                et.psi.to_degrees(),
                tr.alpha_rad.to_degrees(),
                tr.positions
                    .iter()
                    .map(|p| p.1)
                    .fold(0.0, |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a }),
                tr.normal_load_factor_g,
                tick.log.main.elevator_rad.to_degrees(),
                tick.log.main.nozzle_pitch_rad.to_degrees(),
                tick.log.main.rudder_rad.to_degrees(),
                tick.log.brakes,
                tr.position.0.x,
                tr.position.0.y,
                tick.log.level
            );
        }
    }
    eprintln!(
        "end {:?} crash {:?} touchdown {:?}",
        flight.end(),
        flight.plant().crash().map(|c| c.to_string()),
        flight.plant().touchdown()
    );
}
