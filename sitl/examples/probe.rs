//! Throwaway.
use icd::*;
use sitl::closed_loop::*;
use plant_sim::*;
use ::flight_control::*;
fn main() {
    let earth = if std::env::args().any(|a| a == "flat") { EarthModel::Flat } else { EarthModel::Wgs84 };
    let us: u32 = std::env::args().find_map(|a| a.strip_prefix("p=").map(|s| s.parse().unwrap())).unwrap_or(2000);
    let sc = Scenario::from_toml("n", plant_sim::scenario::NOMINAL).unwrap();
    let mut s0 = sc.plant.setup(Airframe::paper(), 0, ControlPeriod::from_micros(us).unwrap(), 1000.min(us));
    s0.earth = earth;
    let belief = sitl::linearize::linearize(&s0).unwrap();
    println!("{}", sitl::linearize::to_toml(&belief).unwrap());
    for (name, text, dur) in [("case1", plant_sim::scenario::CASE1, 90.0), ("case2", plant_sim::scenario::CASE2, 40.0)] {
        for (run, faults, mode) in [("nofault", false, CompensatorMode::Armed), ("pid", true, CompensatorMode::Off), ("rftc", true, CompensatorMode::Armed)] {
            let sc = Scenario::from_toml(name, text).unwrap();
            let mut plant = sc.plant.setup(Airframe::paper(), 0, s0.period, s0.step_us);
            plant.earth = earth;
            if !faults { plant.faults.clear(); }
            let mut gains = Gains::REFERENCE;
            gains.selection.compensator = mode;
            let setup = FlightSetup { plant, belief, gains, references: autopilot::config::references(name, text).unwrap(), duration: SimTime::from_seconds(dur).unwrap() };
            let t0 = std::time::Instant::now();
            let mut n = 0u64;
            let mut last = None;
            let mut maxphi = 0.0f64; let mut maxlevel=0.0f64; let mut act=None; let mut maxnz=0.0f64;
            let every = 5_000_000;
            let end = fly(&setup, &mut |r: &Record| {
                n += 1;
                maxphi = maxphi.max(r.truth.euler.phi.abs());
                maxlevel = maxlevel.max(r.log.level);
                maxnz = maxnz.max((r.truth.normal_load_factor_g-1.0).abs());
                if r.log.compensator_active && act.is_none() { act = Some(r.truth.time); }
                if r.truth.time.as_micros() % every == 0 { println!("  {} H {:.2} phi {:.3} V {:.2} z2 {:?} F {:?} ", r.truth.time, r.truth.altitude_m, r.truth.euler.phi.to_degrees(), r.truth.airspeed_m_s, r.log.z2.as_slice(), fault_acceleration(&DesignModel::new(belief), r).as_slice()); }
                last = Some(*r);
            }).unwrap();
            let el = t0.elapsed().as_secs_f64();
            let r = last.unwrap();
            println!("{name} {run}: end {:?} maxphi {:.2} maxlevel {maxlevel:.3} maxnz {maxnz:.3} act {act:?} H {:.2} phi {:.3} ailR {:.2} dz {:.2} dy {:.2} ucf {:?} x{:.0}", end, maxphi.to_degrees(), r.truth.altitude_m, r.truth.euler.phi.to_degrees(),
              r.truth.deflections[Effector::RightAileron].to_degrees(), r.truth.deflections[Effector::NozzlePitch].to_degrees(), r.truth.deflections[Effector::NozzleYaw].to_degrees(), r.log.compensation.nozzle_yaw_rad.to_degrees(), r.truth.time.as_seconds()/el);
        }
    }
}
