use core::ops::ControlFlow;
use flight_analysis::closed_loop::{Operator, Tick, run, settings};
use flight_analysis::configuration::AircraftArgs;
use flight_analysis::estimator::{Case, flights::Sides};
use flight_analysis::sensor_faults::{kinds, fly_without};
use flight_control::CompensatorMode;
use icd::SimTime;
use icd::fault::{Onset, Timing};
use icd::sensors::SensorKind;
use plant_sim::{GradeName, ScheduledFault};

struct J { every: u64 }
impl Operator for J {
    type Stop = ();
    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<()> {
        let truth = tick.plant.truth();
        if tick.plant.dynamics().airframe().limits.are_exceeded(&truth.into()) {
            println!("LOST {:?}", truth.time);
            return ControlFlow::Break(());
        }
        let us = tick.exchange.time.as_micros();
        if !us.is_multiple_of(self.every) { return ControlFlow::Continue(()); }
        let (Some(e), state) = (tick.estimator, &tick.log.state) else { return ControlFlow::Continue(()) };
        let s = state.estimate.unwrap();
        let w = truth.wind.0;
        let v = (truth.velocity.0 - w).normalize();
        let est = e.estimate();
        let dw = w - est.wind;
        let across = nalgebra::Vector3::new(-v.y, v.x, 0.0).normalize();
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let ax = turned.scaled_axis() * 57.3;
        let f = e.steady_force_probe();
        println!("{:.2},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3},{:.2},{:.3},{:.3},{:.3},{:.2},{},{:.4},{:.4},{:.4}",
            us as f64*1e-6, truth.airspeed_m_s, state.airspeed_m_s, s.airspeed_m_s,
            dw.dot(&v), dw.dot(&across), (w-est.steady_wind).dot(&v), (w-est.steady_wind).dot(&across),
            ax.x, ax.y, ax.z, s.attitude_rad*57.3,
            truth.altitude_m, truth.alpha_rad.to_degrees(), state.alpha.to_degrees(), est.vane_bias[0].to_degrees(), f.z,
            tick.log.compensator_active, est.pitot_bias, est.pitot_scale, truth.load_factor_probe());
        if std::env::var("EX").is_ok() { use flight_control::estimator::probe as p; println!("    lift innov {:.4} sums: vb {:.3} deg wz {:.3} pitch {:.3} deg | gust {:.3} vbs {:.3} | vanes: vb {:.3} wz {:.3}", p(16), p(17).to_degrees(), p(18), p(19).to_degrees(), p(20), p(21), p(22).to_degrees(), p(23)); println!("    vane innov mean {:.4} deg K_b {:.2e} K_wz {:.2e} s_wz {:.3} wz {:.3} K_th {:.2e} s {:.3} deg", p(24).to_degrees(), p(25), p(26), p(27), p(28), p(29), p(30).to_degrees()); }
        ControlFlow::Continue(())
    }
}
trait P { fn load_factor_probe(&self) -> f64; }
impl P for plant_sim::Truth { fn load_factor_probe(&self) -> f64 { self.attitude.euler().phi.to_degrees() } }

fn main() {
    let a: Vec<String> = std::env::args().collect();
    for i in 0..16 { if let Ok(v) = std::env::var(format!("P{i}")) { flight_control::estimator::set_probe(i, v.parse().unwrap()); } }
    let grade = GradeName::ALL.into_iter().find(|g| g.key() == a[3]).unwrap();
    let aircraft = AircraftArgs { airframe: (a[2] != "tvc_jet").then(|| a[2].clone().into()), ..Default::default() };
    let sides = Sides::of(&aircraft).unwrap();
    let rms: f64 = a[4].parse().unwrap();
    let turns = a[5] == "turns";
    let off = kinds(SensorKind::Pitot).into_iter().find(|k| k.info().key == "off").unwrap();
    if a[1] == "table" {
        let n: u64 = a[6].parse().unwrap();
        let seed0: u64 = a.get(7).map_or(1, |s| s.parse().unwrap());
        let fault = if a.get(8).is_some_and(|s| s == "healthy") { None } else { Some((SensorKind::Pitot, off)) };
        let work = std::sync::atomic::AtomicU64::new(0);
        let rows = std::sync::Mutex::new(vec![]);
        std::thread::scope(|sc| for _ in 0..2 { sc.spawn(|| loop {
            let i = work.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if i >= n { break; }
            let l = fly_without(&sides, grade, rms, turns, fault, seed0 + i).unwrap();
            rows.lock().unwrap().push((seed0 + i, l));
        }); });
        let mut rows = rows.into_inner().unwrap();
        rows.sort_by_key(|r| r.0);
        if a.get(9).is_some() { for (s, l) in &rows { println!("  seed {s} lost {:?} rms {:.2} st {:.2} max {:.1} alt {:.1} att {:.2} nees {:.1} act {:.2}", l.lost_at_s, l.airspeed[0].sqrt(), l.airspeed[1].sqrt(), l.largest[0], l.largest[1], l.largest[2], l.wind_nees, l.active); } }
        let kept: Vec<_> = rows.iter().filter(|r| r.1.lost_at_s.is_none()).collect();
        let m = |f: &dyn Fn(&flight_analysis::sensor_faults::Lost) -> f64| kept.iter().map(|r| f(&r.1)).sum::<f64>() / kept.len().max(1) as f64;
        let x = |p: usize| kept.iter().map(|r| r.1.largest[p]).fold(0.0, f64::max);
        println!("{} {} {} {}: lost {}/{} rms {:.2} stated {:.2} max {:.1} alt {:.1} att {:.2} nees {:.2} active {:.2}", a[2], a[3], a[4], a[5], rows.len() - kept.len(), n,
            m(&|l| l.airspeed[0]).sqrt(), m(&|l| l.airspeed[1]).sqrt(), x(0), x(1), x(2), m(&|l| l.wind_nees), m(&|l| l.active));
        return;
    }
    let seed: u64 = a[6].parse().unwrap();
    let case = Case { name: grade.key(), grade, vanes: true };
    let mut setup = sides.setup(&case, rms, seed).unwrap();
    setup.parameters.gains.selection.compensator = CompensatorMode::Armed;
    setup.duration = SimTime::from_seconds(640.0).unwrap();
    let start = &setup.plant.start;
    let (alt, v) = (start.altitude_m, start.airspeed_m_s);
    let entry = |at: f64, roll: f64| format!("[[autopilot.reference]]\nat_s = {at:?}\nroll_deg = {roll:?}\naltitude_m = {alt:?}\nairspeed_m_s = {v:?}\n");
    let mut programme = entry(0.0, 0.0);
    for part in 0..if turns { 10 } else { 0 } {
        let (at, side) = (40.0 + 60.0 * part as f64, [1.0, -1.0][part % 2]);
        programme += &entry(at, 30.0 * side);
        programme += &entry(at + 30.0, 0.0);
    }
    setup.references = autopilot::config::references("the study", &programme).unwrap();
    let timing = Timing::from_onset(Onset::At(SimTime::from_seconds(40.0).unwrap()));
    if a.get(8).is_none() { setup.plant.faults = vec![ScheduledFault { target: SensorKind::Pitot.into(), kind: off, timing }]; }
    println!("t,V,Vest,sig,dwa,dwc,dsa,dsc,ax,ay,az,satt,alt,alpha,aest,vb,fz,act,pb,ps,roll");
    let mut j = J { every: a.get(7).map_or(1_000_000, |s| s.parse().unwrap()) };
    run(&setup.plant, &settings(&setup), setup.duration, &mut j).unwrap();
}
