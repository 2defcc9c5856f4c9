//! How an aircraft comes down: the first touchdown of a flight over a ground, and where it stops.

use lab_engine::flight::Tick;
use plant_sim::touchdown::Touchdown;

use crate::Judge;

/// Slower than this over the ground the aircraft has stopped, m/s.
const STOPPED_M_S: f64 = 0.5;

/// Numbers of the judge; places are along the runway from its threshold and to the right of its centre line.
pub const COLUMNS: [(&str, &str); 9] = [
    ("touchdown_sink", "m/s"),
    ("touchdown_along", "m"),
    ("touchdown_across", "m"),
    ("touchdown_roll", "rad"),
    ("touchdown_pitch", "rad"),
    ("touchdown_crab", "rad"),
    ("touchdown_airspeed", "m/s"),
    ("bounces", "1"),
    ("stop_after", "s"),
];

/// The touchdown, and the time from there to the stop.
#[derive(Debug, Clone, Default)]
pub struct LandingJudge {
    touchdown: Option<Touchdown>,
    stop_s: Option<f64>,
}

impl Judge for LandingJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let Some(touchdown) = tick.plant.touchdown() else { return };
        self.touchdown = Some(*touchdown);
        if self.stop_s.is_none() && tick.plant.truth().velocity.0.norm() < STOPPED_M_S {
            let since = tick.exchange.time.as_seconds() - touchdown.time.as_seconds();
            self.stop_s = Some(since);
        }
    }

    fn values(&self) -> Vec<Option<f64>> {
        let of = |value: fn(&Touchdown) -> f64| self.touchdown.as_ref().map(value);
        vec![
            of(|down| down.sink_m_s),
            of(|down| down.along_m),
            of(|down| down.across_m),
            of(|down| down.roll_rad),
            of(|down| down.pitch_rad),
            of(|down| down.crab_rad),
            of(|down| down.airspeed_m_s),
            of(|down| f64::from(down.bounces)),
            self.stop_s,
        ]
    }
}
