//! One flight at the full control rate, with what the claims look at.

use flight_control::{Compensation, DesignModel};
use icd::ControlPeriod;
use plant_sim::FlightLimits;

use crate::closed_loop::Record;
use crate::trajectory::{self, Row};

/// Times closer than this are the same tick, s.
const SAME_TICK_S: f64 = 0.5e-6;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// The columns of the tables.
    pub row: Row,
    /// Climb rate over the ground, m/s.
    pub climb_rate_m_s: f64,
    /// Position north of the start, m.
    pub north_m: f64,
    /// Position east of the start, m.
    pub east_m: f64,
    /// Density of the air, kg/m³.
    pub density_kg_m3: f64,
    /// Compensation that was let through and applied, rad.
    pub applied: Compensation,
}

impl Sample {
    /// From a record; `model` is the controller's, against which the truth F is measured.
    pub fn of(model: &DesignModel, record: &Record) -> Self {
        let (truth, log) = (&record.truth, &record.log);
        Self {
            row: Row::of(model, record),
            climb_rate_m_s: -truth.velocity.0.z,
            north_m: truth.position.0.x,
            east_m: truth.position.0.y,
            density_kg_m3: truth.density_kg_m3,
            applied: log.applied_compensation,
        }
    }

    /// Whether two ticks are the same to the bit, signs of zeros included.
    pub fn is_identical(&self, other: &Self) -> bool {
        let bits = |s: &Self| {
            let extra = [
                s.climb_rate_m_s,
                s.north_m,
                s.east_m,
                s.density_kg_m3,
                s.applied.aileron_rad,
                s.applied.nozzle_pitch_rad,
                s.applied.nozzle_yaw_rad,
            ];
            (s.row.values().map(f64::to_bits), extra.map(f64::to_bits))
        };
        bits(self) == bits(other)
    }
}

/// One flight, every control tick of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    samples: Vec<Sample>,
    period: ControlPeriod,
    on_ground: bool,
    limits: FlightLimits,
}

impl Trace {
    /// From the ticks of a flight, in order, one each control period; `on_ground` is how it ended, `limits` when the
    /// aircraft counts as lost.
    pub fn new(
        samples: Vec<Sample>,
        period: ControlPeriod,
        on_ground: bool,
        limits: FlightLimits,
    ) -> Self {
        Self { samples, period, on_ground, limits }
    }

    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// When the aircraft counts as lost.
    pub fn limits(&self) -> FlightLimits {
        self.limits
    }

    /// Whether the flight ended on the ground.
    pub fn on_ground(&self) -> bool {
        self.on_ground
    }

    /// Time of the last tick, s; zero for a flight without ticks.
    pub fn end_s(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.row.t_s)
    }

    /// The ticks from `from_s` to `to_s`, both included.
    pub fn window(&self, from_s: f64, to_s: f64) -> &[Sample] {
        let first = self.samples.partition_point(|s| s.row.t_s < from_s - SAME_TICK_S);
        let past = self.samples.partition_point(|s| s.row.t_s <= to_s + SAME_TICK_S);
        // A window that ends before it begins is empty.
        &self.samples[first..past.max(first)]
    }

    /// The ticks before `t_s`.
    pub fn before(&self, t_s: f64) -> &[Sample] {
        &self.samples[..self.samples.partition_point(|s| s.row.t_s < t_s - SAME_TICK_S)]
    }

    /// The ticks from `from_s` on.
    pub fn from(&self, from_s: f64) -> &[Sample] {
        self.window(from_s, f64::MAX)
    }

    /// The ticks of the last `seconds` of the flight.
    pub fn last(&self, seconds: f64) -> &[Sample] {
        self.from(self.end_s() - seconds)
    }

    /// The first tick at or after `t_s`, or the last one of a flight that ended earlier.
    ///
    /// `None` only for a flight without ticks.
    pub fn at(&self, t_s: f64) -> Option<&Sample> {
        self.from(t_s).first().or(self.samples.last())
    }

    /// When the aircraft was lost, s; `None` if it was not.
    pub fn lost_at(&self) -> Option<f64> {
        let lost = |s: &&Sample| self.limits.are_exceeded(&(&s.row).into());
        self.samples.iter().find(lost).map(|s| s.row.t_s)
    }

    /// The rows of the table: every tick that [`trajectory::ticks_per_row`] picks.
    pub fn table_rows(&self) -> impl Iterator<Item = &Row> {
        self.samples.iter().step_by(trajectory::ticks_per_row(self.period)).map(|s| &s.row)
    }
}

/// One signal of some ticks.
pub fn column(
    samples: &[Sample],
    signal: impl Fn(&Row) -> f64 + Clone,
) -> impl Iterator<Item = f64> + Clone {
    samples.iter().map(move |sample| signal(&sample.row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_sim::ReadAirframe as _;

    fn limits() -> FlightLimits {
        plant_sim::Airframe::paper().limits
    }

    fn ramp(period_us: u32, ticks: u32) -> Trace {
        let period = ControlPeriod::from_micros(period_us).unwrap();
        let sample = |k: u32| Sample {
            row: Row {
                t_s: f64::from(k * period_us) / 1.0e6,
                altitude_m: 1_000.0 - f64::from(k),
                ..Row::default()
            },
            ..Sample::default()
        };
        Trace::new((0..ticks).map(sample).collect(), period, false, limits())
    }

    #[test]
    fn a_window_includes_both_of_its_ends() {
        let trace = ramp(2_000, 1_000);
        let window = trace.window(0.1, 0.2);
        assert_eq!(window.len(), 51);
        assert_eq!(trace.before(0.1).len(), 50);
        assert_eq!(trace.last(0.01).len(), 6);
        assert!(trace.window(0.2, 0.1).is_empty());
    }

    #[test]
    fn after_the_end_the_last_tick_stands() {
        let trace = ramp(1_000, 100);
        assert_eq!(trace.at(7.0).unwrap().row.t_s, trace.end_s());
        assert!(Trace::new(vec![], ControlPeriod::DEFAULT, false, limits()).at(0.0).is_none());
    }

    #[test]
    fn the_loss_is_the_first_tick_outside_the_envelope() {
        // Altitude 1000 - k m at 1 ms: below 500 m first at k = 501.
        let trace = ramp(1_000, 700);
        assert_eq!(trace.lost_at(), Some(0.501));
        assert_eq!(ramp(1_000, 400).lost_at(), None);
    }

    #[test]
    fn table_rows_start_at_zero_and_are_12_ms_apart_at_4_ms() {
        let times: Vec<f64> = ramp(4_000, 10).table_rows().map(|row| row.t_s).collect();
        assert_eq!(times, [0.0, 0.012, 0.024, 0.036]);
    }

    #[test]
    fn identical_means_the_bits_not_the_numbers() {
        let plus = Sample::default();
        let minus = Sample { north_m: -0.0, ..plus };
        assert_eq!(plus, minus);
        assert!(plus.is_identical(&plus) && !plus.is_identical(&minus));
    }
}
