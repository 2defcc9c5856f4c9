//! What each property of an actuator does to steps and triangles: `sitl study actuators`.
//!
//! ```text
//! airframe, effector ─> one property at a time ─> plant, held in its trimmed flight ─> step, triangle, travel ─> table, picture
//! ```

use host_io::print_line;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::{Actuators, ControlPeriod, Effector, EffectorKind};
use lab_tables::{Table, cells, table};
use plant_sim::dynamics::State;
use plant_sim::servos::{Imperfections, SecondOrder, Servo};
use plant_sim::trim::Trim;
use plant_sim::{Airframe, EarthModel, Plant, PlantPart, PlantSetup};

use host_io::problem::{Problem, problem};
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::Target;
use lab_report::chart::panel::{Curve, Panel};
use lab_report::chart::{Figure, Ink, Pattern, sheet, write_figure};

/// The step, s, and the length of its panel.
const STEP_AT_S: f64 = 0.1;
const STEP_S: f64 = 1.2;
/// Period of the triangle, s, and the length of its panel.
const TRIANGLE_PERIOD_S: f64 = 2.0;
const TRIANGLE_S: f64 = 3.0;
/// Height of step and triangle, as a part of the travel.
const PART_OF_TRAVEL: f64 = 0.4;
/// Airspeeds at which the travel is measured, as parts of that of the trim, and the time until the effector is there.
const SPEEDS: [f64; 2] = [0.3, 1.5];
const SPEED_COUNT: u32 = 25;
const TRAVEL_S: f64 = 3.0;

/// Options of `sitl study actuators`.
#[derive(Debug, Clone, clap::Args)]
pub struct ActuatorsArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// The effector, as left_elevator [default: the rudder, else the first one that turns]
    #[arg(long, value_name = "NAME")]
    effector: Option<String>,
    /// Folder for the table and the picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// One property of an actuator.
struct Property {
    title: String,
    servo: Servo,
}

/// Positions of the effector over time, deg, and what was commanded.
struct Response {
    property: String,
    signal: &'static TestSignal,
    /// Time, s; command, ideal actuator, actuator with the property, deg.
    rows: Vec<[f64; 4]>,
}

/// What the effector is commanded.
struct TestSignal {
    name: &'static str,
    seconds: f64,
    /// Between -1 and 1.
    at: fn(time_s: f64) -> f64,
}

const STEP: TestSignal = TestSignal {
    name: "step",
    seconds: STEP_S,
    at: |time_s| f64::from(u8::from(time_s >= STEP_AT_S)),
};

const TRIANGLE: TestSignal = TestSignal {
    name: "triangle",
    seconds: TRIANGLE_S,
    at: |time_s| {
        let part = (time_s / TRIANGLE_PERIOD_S + 0.25) % 1.0;
        if part < 0.5 { 4.0 * part - 1.0 } else { 3.0 - 4.0 * part }
    },
};

/// An actuator on a test bench: the aircraft is held in its trimmed flight.
struct Bench {
    setup: PlantSetup,
    /// Of the aircraft with its own actuators.
    trim: Trim,
    effector: Effector,
    /// Height of step and triangle, rad.
    height: f64,
}

/// Moves, draws and writes.
pub fn run(args: &ActuatorsArgs) -> Result<(), Problem> {
    args.aircraft.check_read(&[Target::Airframe, Target::Scenario])?;
    let folder = OutFolder::create(&args.out)?;
    let bench = args.bench()?;
    let responses = bench.responses()?;
    let travel = bench.travel()?;
    table(&responses).write(folder.path())?;
    write_figure(&folder, &bench.figure(&responses, travel))?;
    for Response { property, signal, rows } in &responses {
        let apart = rows.iter().map(|[_, _, ideal, at]| (at - ideal).abs()).fold(0.0_f64, f64::max);
        let signal = signal.name;
        print_line!("{property:<46} {signal:<8} up to {apart:6.3} deg from the ideal actuator");
    }
    print_line!("wrote {}", args.out.display());
    Ok(())
}

impl ActuatorsArgs {
    fn bench(&self) -> Result<Bench, Problem> {
        let airframe = self.aircraft.airframe()?;
        let list = airframe.effectors;
        let angles = || list.all().filter(|effector| list.is_angle(*effector));
        let effector = match &self.effector {
            Some(name) => list.by_key(name).filter(|effector| list.is_angle(*effector)),
            None => list.of_kind(EffectorKind::Rudder).next().or_else(|| angles().next()),
        };
        let effector = effector.ok_or_else(|| {
            let known: Vec<&str> = angles().map(|effector| list.key(effector)).collect();
            match &self.effector {
                Some(name) => problem!("--effector {name}: expected one of {}", known.join(", ")),
                None => problem!("the aircraft has no effector that turns"),
            }
        })?;
        let servo = airframe.servos[effector];
        // By the shorter side, so that the triangle stays inside the travel both ways.
        let height = PART_OF_TRAVEL * servo.max.min(-servo.min);
        let scenario = self.aircraft.scenario(&Named::scenario("nominal")?, &list)?.plant;
        let setup = PlantPart { earth: EarthModel::Flat, ..scenario };
        let setup = setup.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
        let mut trim = *Plant::new(&setup)?.trim();
        // The signals begin at zero, and so does the actuator; the body is held, whatever moves on it.
        trim.positions[effector] = 0.0;
        Ok(Bench { setup, trim, effector, height })
    }
}

impl Bench {
    fn servo(&self) -> Servo {
        self.setup.airframe.servos[self.effector]
    }

    /// The same actuator with nothing but lag, rate limit and travel.
    fn ideal(&self) -> Servo {
        let imperfections = Imperfections::default();
        Servo { second_order: None, imperfections, ..self.servo() }
    }

    /// One property at a time: that of the aircraft, or an example where its actuator is ideal in it.
    fn properties(&self, pressure_pa: f64) -> Vec<Property> {
        let (own, ideal, height) = (self.servo(), self.ideal(), self.height);
        let is_surface =
            self.setup.airframe.effectors.kind(self.effector).is_some_and(EffectorKind::is_surface);
        let or = |value: f64, example: f64| if value == 0.0 { example } else { value };
        let order = own.second_order.unwrap_or(SecondOrder {
            natural_frequency_rad_s: 0.8 / own.lag_s,
            damping_ratio: 0.4,
        });
        let own = own.imperfections;
        let deadband = or(own.deadband, 0.15 * height);
        let hysteresis = or(own.hysteresis, 0.3 * height);
        let bias = or(own.bias, 0.2 * height);
        let delay_s = or(own.delay_s, 0.1);
        // The example stalls at 0.6 of the height.
        let stall_pa = own.stall_pressure_pa.unwrap_or(0.6 * height / ideal.max * pressure_pa);
        let rate_limit = 0.25 * ideal.rate_limit;
        let with = |title: String, imperfections: Imperfections| Property {
            title,
            servo: Servo { imperfections, ..ideal },
        };
        let none = Imperfections::default();
        let deg = f64::to_degrees;
        let mut all = vec![
            Property {
                title: format!(
                    "second order, {:.1} rad/s, damping {}",
                    order.natural_frequency_rad_s, order.damping_ratio
                ),
                servo: Servo { second_order: Some(order), ..ideal },
            },
            Property {
                title: format!("rate limit of {:.1} deg/s", deg(rate_limit)),
                servo: Servo { rate_limit, ..ideal },
            },
            with(format!("delay of {:.0} ms", 1.0e3 * delay_s), Imperfections { delay_s, ..none }),
            with(
                format!("deadband of {:.2} deg", deg(deadband)),
                Imperfections { deadband, ..none },
            ),
            with(
                format!("hysteresis of {:.2} deg", deg(hysteresis)),
                Imperfections { hysteresis, ..none },
            ),
            with(format!("bias of {:.2} deg", deg(bias)), Imperfections { bias, ..none }),
        ];
        if is_surface {
            all.push(with(
                format!(
                    "stall from {:.1} kPa on, at {:.1} kPa",
                    stall_pa / 1.0e3,
                    pressure_pa / 1.0e3
                ),
                Imperfections { stall_pressure_pa: Some(stall_pa), ..none },
            ));
        }
        all
    }

    fn plant(&self, servo: Servo) -> Result<Plant, Problem> {
        let mut setup = self.setup.clone();
        setup.airframe.servos[self.effector] = servo;
        // Its own trim may not exist: an actuator that stalls does not reach the position of level flight.
        Ok(Plant::with_trim(&setup, &self.trim)?)
    }

    /// Positions of the effector at the end of each period, deg, in the trimmed flight at `speed` times its airspeed; commands in
    /// rad.
    fn hold(
        &self,
        plant: &mut Plant,
        speed: f64,
        seconds: f64,
        command: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let mut rigid = plant.trim().rigid;
        rigid.velocity.0 *= speed;
        let mut commands = plant.trim().positions();
        let mut positions = Vec::new();
        while plant.time().as_seconds() < seconds {
            // The body begins each period where it was: only the actuators move on.
            plant.resume_from(&State { rigid, ..*plant.state() });
            commands[self.effector] = command(plant.time().as_seconds());
            plant.advance(&Actuators::new(commands));
            positions.push(plant.truth().positions[self.effector].to_degrees());
        }
        positions
    }

    fn responses(&self) -> Result<Vec<Response>, Problem> {
        let ideal = self.plant(self.ideal())?;
        let pressure_pa = ideal.truth().dynamic_pressure_pa();
        let mut responses = Vec::new();
        for Property { title, servo } in self.properties(pressure_pa) {
            for signal in [&STEP, &TRIANGLE] {
                let command = |time_s| self.height * (signal.at)(time_s);
                let move_it = |plant: &mut Plant| self.hold(plant, 1.0, signal.seconds, command);
                let without = move_it(&mut ideal.clone());
                let with = move_it(&mut self.plant(servo)?);
                let period_s = self.setup.period.as_seconds();
                let row = |(tick, (ideal, at)): (usize, (f64, f64))| {
                    // A position is that of the end of its period.
                    let time_s = period_s * (tick + 1) as f64;
                    [time_s, command(time_s).to_degrees(), ideal, at]
                };
                let rows = without.into_iter().zip(with).enumerate().map(row).collect();
                responses.push(Response { property: title.clone(), signal, rows });
            }
        }
        Ok(responses)
    }

    /// The position that a command of the full travel reaches, deg, over the dynamic pressure, kPa; empty for what does not stall.
    fn travel(&self) -> Result<Vec<(f64, f64)>, Problem> {
        let pressure_pa = self.plant(self.ideal())?.truth().dynamic_pressure_pa();
        let mut properties = self.properties(pressure_pa);
        let stalls = |property: &Property| property.servo.imperfections.stall_pressure_pa.is_some();
        // The stall is the last one, where the effector has it.
        let Some(property) = properties.pop().filter(stalls) else { return Ok(Vec::new()) };
        let plant = self.plant(property.servo)?;
        let at = |place: u32| {
            let part = f64::from(place) / f64::from(SPEED_COUNT - 1);
            let speed = SPEEDS[0] + part * (SPEEDS[1] - SPEEDS[0]);
            let mut plant = plant.clone();
            let reached = self.hold(&mut plant, speed, TRAVEL_S, |_| property.servo.max);
            let kpa = 1.0e-3 * plant.truth().dynamic_pressure_pa();
            (kpa, reached.last().copied().unwrap_or(f64::NAN))
        };
        Ok((0..SPEED_COUNT).map(at).collect())
    }

    fn figure(&self, responses: &[Response], travel: Vec<(f64, f64)>) -> Figure {
        let commanded = Ink::new("#999999", Pattern::Dashed).wide(1.2);
        let ideal = Ink::new("#0050aa", Pattern::Solid).wide(1.2);
        let with = Ink::new("#d95f02", Pattern::Solid).wide(2.0);
        let legend = [
            ("command", commanded),
            ("lag, rate limit and travel of the aircraft", ideal),
            ("with the property", with),
        ];
        let mut panels: Vec<Panel<'_>> = responses
            .iter()
            .map(|Response { property, signal, rows }| {
                let curve = |column: usize, ink| {
                    let points = rows.iter().map(|row| (row[0], row[column])).collect();
                    Curve::unnamed(points, ink)
                };
                let curves = vec![curve(1, commanded), curve(2, ideal), curve(3, with)];
                let values = rows.iter().flat_map(|row| row[1..].iter().copied());
                Panel {
                    title: property.clone(),
                    x_label: "time, s",
                    y_label: "deg",
                    x: (0.0, signal.seconds),
                    y: lab_report::chart::axis::range(values, 1.0e-3),
                    height: 150.0,
                    curves,
                    ..Panel::default()
                }
            })
            .collect();
        if let (Some(first), Some(last)) = (travel.first().copied(), travel.last().copied()) {
            panels.push(Panel {
                title: "travel that is reached, with the same stall".to_owned(),
                x_label: "dynamic pressure, kPa",
                y_label: "deg",
                x: (first.0, last.0),
                y: (0.0, 1.16 * first.1),
                height: 150.0,
                curves: vec![Curve::unnamed(travel, with)],
                ..Panel::default()
            });
        }
        let Airframe { effectors, name, .. } = &self.setup.airframe;
        let title = format!(
            "Actuator of the {} of {name}: step and triangle of {:.1} deg",
            effectors.name(self.effector),
            self.height.to_degrees()
        );
        let caption = "Response of an actuator to a step and a triangle, with one property each";
        let svg = sheet(&title, &legend, 2, &panels);
        Figure { name: "actuators", caption: caption.to_owned(), svg }
    }
}

fn table(responses: &[Response]) -> Table {
    let mut table = table!("actuators",
        property: Text, signal: Text, time_s: Number, command_deg: Number, ideal_deg: Number,
        position_deg: Number);
    for Response { property, signal, rows } in responses {
        for [time_s, command, ideal, at] in rows {
            table.rows.push(cells![property, signal.name, *time_s, *command, *ideal, *at]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;

    #[derive(Debug, clap::Parser)]
    struct Command {
        #[command(flatten)]
        args: ActuatorsArgs,
    }

    fn bench(options: &str) -> Result<Bench, String> {
        let words = ["actuators", "--out", "x"].into_iter().chain(options.split_whitespace());
        let args = Command::try_parse_from(words).unwrap().args;
        args.bench().map_err(|error| error.to_string())
    }

    #[test]
    fn every_property_is_seen_in_its_panels_and_the_travel_falls() {
        let bench = bench("").unwrap();
        let responses = bench.responses().unwrap();
        assert_eq!(responses.len(), 14);
        for Response { property, signal, rows } in &responses {
            let apart = rows.iter().map(|[_, _, ideal, at]| (at - ideal).abs());
            let apart = apart.fold(0.0_f64, f64::max);
            // A step larger than the deadband passes it.
            let is_seen = !(property.starts_with("deadband") && signal.name == "step");
            assert_eq!(apart > 0.3, is_seen, "{property}, {}: {apart} deg", signal.name);
        }
        let travel = bench.travel().unwrap();
        assert_eq!(travel.len(), SPEED_COUNT as usize);
        assert!((travel[0].1 - 30.0).abs() < 1.0e-3 && travel[24].1 < 5.0, "{travel:?}");
        let svg = bench.figure(&responses, travel).svg;
        assert!(svg.contains("hysteresis of 3.60 deg") && svg.contains("kPa"));
        assert!(table(&responses).csv().contains("delay of 100 ms,step,0.002,0,"));
    }

    #[test]
    fn an_actuator_that_stalls_short_of_level_flight_is_moved_all_the_same() {
        let bench = bench("--airframe aerosonde --effector left_elevator").unwrap();
        let properties = bench.responses().unwrap();
        assert!(properties.iter().any(|response| response.property.starts_with("stall")));
        // Before the step nothing moves, though level flight needs 8 deg of this elevator.
        let [_, command, ideal, _] = properties[0].rows[0];
        assert_eq!((command, ideal), (0.0, 0.0));
        assert!(!bench.travel().unwrap().is_empty());
    }

    #[test]
    fn what_the_aircraft_has_takes_the_place_of_the_example_and_a_nozzle_has_no_stall() {
        let set = "--set airframe.effector.6.deadband_deg=0.25 --effector nozzle_pitch";
        let bench = bench(set).unwrap();
        let titles: Vec<String> =
            bench.properties(1.0e4).into_iter().map(|property| property.title).collect();
        assert!(titles.contains(&"deadband of 0.25 deg".to_owned()), "{titles:?}");
        assert_eq!(titles.len(), 6);
        assert!(bench.travel().unwrap().is_empty());
    }

    #[test]
    fn an_effector_that_does_not_turn_is_refused_with_those_that_do() {
        let refused = bench("--effector engine").err().unwrap();
        assert_eq!(
            refused,
            "--effector engine: expected one of left_aileron, right_aileron, left_elevator, right_elevator, rudder, \
             nozzle_pitch, nozzle_yaw"
        );
    }
}
