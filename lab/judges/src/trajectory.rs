//! Flights as tables: one row a sampled control tick, one column a signal.

use flight_control::StepLog;
use icd::{ControlPeriod, Effector, EffectorKind, EffectorList};
use lab_tables::Cell;
use plant_sim::Truth;

pub use crate::row::Row;

/// Rows of a file are at least this far apart, us: 100 Hz.
const ROW_SPACING_US: u32 = 10_000;

/// Control ticks from one row to the next: as close to 100 Hz as whole ticks come without exceeding it.
///
/// 10 ms at periods of 1, 2 and 2.5 ms, 12 ms at 3 and 4 ms.
pub fn ticks_per_row(period: ControlPeriod) -> usize {
    ROW_SPACING_US.div_ceil(period.as_micros()) as usize
}

/// Header and rows as comma-separated text; every value reads back as the same bits.
pub fn to_csv<'a>(rows: impl IntoIterator<Item = &'a Row>) -> String {
    rows.into_iter().fold(header(), |text, row| text + &line(row.values()))
}

/// The first line of a table.
pub fn header() -> String {
    Row::NAMES.join(",") + "\n"
}

/// The columns for any aircraft: those of [`Row`], with its own effectors where those of the paper's jet stand.
#[derive(Debug, Clone)]
pub struct Columns {
    names: Vec<String>,
    sources: Vec<CellSource>,
}

/// Where a column comes from.
#[derive(Debug, Clone, Copy)]
enum CellSource {
    /// A place in [`Row`].
    Row(usize),
    /// What is left of an effector's position.
    Position(Effector),
    /// The command of an effector.
    Command(Effector),
}

impl Columns {
    /// For an aircraft with these effectors.
    pub fn of(effectors: &EffectorList) -> Self {
        let mut columns = Self { names: Vec::new(), sources: Vec::new() };
        let is_command = |column: &str| column.starts_with("cmd_");
        let is_position = |column: &str| {
            Row::NAMES.iter().any(|other| other.strip_prefix("cmd_") == Some(column))
        };
        let mut before = "";
        for (place, column) in Row::NAMES.iter().enumerate() {
            if is_position(column) {
                // All effectors stand where the first column of the group stood.
                if !is_position(before) {
                    columns.add("", effectors, CellSource::Position);
                }
            } else if is_command(column) {
                if !is_command(before) {
                    columns.add("cmd_", effectors, CellSource::Command);
                }
            } else if !is_of_missing_nozzle(column, effectors) {
                columns.names.push((*column).to_owned());
                columns.sources.push(CellSource::Row(place));
            }
            before = column;
        }
        columns
    }

    fn add(&mut self, prefix: &str, effectors: &EffectorList, source: fn(Effector) -> CellSource) {
        for effector in effectors.all() {
            self.names.push(format!("{prefix}{}", name(effectors, effector)));
            self.sources.push(source(effector));
        }
    }

    /// The first line of a table.
    pub fn header(&self) -> String {
        self.names.join(",") + "\n"
    }

    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The values of a tick.
    pub fn values(&self, row: &Row, truth: &Truth, log: &StepLog) -> impl Iterator<Item = f64> {
        let row = row.values();
        self.sources.iter().map(move |source| match *source {
            CellSource::Row(place) => row[place],
            CellSource::Position(effector) => truth.deflections[effector],
            CellSource::Command(effector) => log.commands[effector],
        })
    }

    /// Adds the line of a tick.
    pub fn push(&self, text: &mut String, row: &Row, truth: &Truth, log: &StepLog) {
        *text += &line(self.values(row, truth, log));
    }
}

/// Name of an effector's column; the only engine is the thrust.
fn name(effectors: &EffectorList, effector: Effector) -> String {
    if effectors.only(EffectorKind::Engine) == Some(effector) {
        return "thrust_n".to_owned();
    }
    format!("{}_{}", effectors.key(effector), effectors.unit(effector))
}

/// Whether a column is about a nozzle that the aircraft does not have.
fn is_of_missing_nozzle(column: &str, effectors: &EffectorList) -> bool {
    [EffectorKind::NozzlePitch, EffectorKind::NozzleYaw]
        .into_iter()
        .any(|kind| column.contains(kind.key()) && effectors.only(kind).is_none())
}

fn line(values: impl IntoIterator<Item = f64>) -> String {
    let cells = values.into_iter().map(|value| Cell::Number(value).to_string());
    cells.collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_sim::ReadAirframe as _;
    use proptest::prelude::*;

    const COUNT: usize = Row::NAMES.len();

    /// The columns as the documentation promises them to users' scripts.
    const PROMISED: &str = "t_s p_rad_s q_rad_s r_rad_s phi_rad theta_rad psi_rad airspeed_m_s alpha_rad \
        beta_rad altitude_m left_aileron_rad right_aileron_rad left_elevator_rad right_elevator_rad \
        rudder_rad nozzle_pitch_rad nozzle_yaw_rad thrust_n z2_p_rad_s2 z2_q_rad_s2 z2_r_rad_s2 \
        fault_p_rad_s2 fault_q_rad_s2 fault_r_rad_s2 compensator_active nz_g cmd_left_aileron_rad \
        cmd_right_aileron_rad cmd_left_elevator_rad cmd_right_elevator_rad cmd_rudder_rad \
        cmd_nozzle_pitch_rad cmd_nozzle_yaw_rad cmd_thrust_n main_aileron_rad ucf_aileron_rad \
        ucf_nozzle_pitch_rad ucf_nozzle_yaw_rad";

    fn parse(line: &str) -> Vec<f64> {
        line.split(',').map(|field| field.parse().unwrap()).collect()
    }

    #[test]
    fn the_columns_are_those_promised_in_that_order() {
        let promised: Vec<_> = PROMISED.split_whitespace().collect();
        assert_eq!(Row::NAMES, *promised);
    }

    #[test]
    fn the_columns_follow_the_effectors_of_the_aircraft() {
        assert_eq!(Columns::of(&icd::tvc_jet::effectors()).header(), header());
        let text = aircraft::AEROSONDE_AIRFRAME;
        let airframe = plant_sim::Airframe::from_toml("aerosonde.toml", text).unwrap();
        let columns = Columns::of(&airframe.effectors);
        assert!(columns.names.iter().all(|name| !name.contains("nozzle")), "{:?}", columns.names);
        let engine = airframe.effectors.only(EffectorKind::Engine).unwrap();
        let place = columns.names.iter().position(|name| name == "cmd_thrust_n").unwrap();
        assert!(matches!(columns.sources[place], CellSource::Command(found) if found == engine));
        assert_eq!(columns.names.len(), COUNT - 2 * 2 - 2);
    }

    proptest! {
        #[test]
        fn every_value_reads_back_as_the_same_bits(bits in proptest::array::uniform32(any::<u64>())) {
            let mut values = [0.5; COUNT];
            for (value, bits) in values.iter_mut().zip(bits) {
                let drawn = f64::from_bits(bits);
                // What is not finite never reaches a table.
                *value = if drawn.is_finite() { drawn } else { -0.0 };
            }
            let text = to_csv([&Row::from_values(&values)]);
            let back = parse(text.lines().nth(1).unwrap());
            prop_assert_eq!(back.len(), COUNT);
            for (index, (sent, read)) in values.iter().zip(&back).enumerate() {
                prop_assert_eq!(sent.to_bits(), read.to_bits(), "column {}: {} {}", index, sent, read);
            }
        }
    }

    #[test]
    fn a_value_stands_under_its_own_name() {
        let row = Row { nz_g: 1.25, t_s: 3.0, ucf_nozzle_yaw_rad: -0.1, ..Row::default() };
        let text = to_csv([&row]);
        let mut lines = text.lines();
        let header: Vec<_> = lines.next().unwrap().split(',').collect();
        let values = parse(lines.next().unwrap());
        let column = |name: &str| values[header.iter().position(|n| *n == name).unwrap()];
        assert_eq!((column("t_s"), column("nz_g")), (3.0, 1.25));
        assert_eq!(column("ucf_nozzle_yaw_rad"), -0.1);
        assert_eq!(column("cmd_thrust_n"), 0.0);
    }

    #[test]
    fn rows_are_closest_to_100_hz_from_above() {
        let expected = [
            (1_000, 10_000),
            (2_000, 10_000),
            (2_500, 10_000),
            (3_000, 12_000),
            (4_000, 12_000),
            (1_100, 11_000),
        ];
        for (period_us, spacing_us) in expected {
            let period = ControlPeriod::from_micros(period_us).unwrap();
            let spacing = ticks_per_row(period) * period_us as usize;
            assert_eq!(spacing, spacing_us, "period {period_us} us");
        }
    }
}
