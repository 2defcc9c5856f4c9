//! Logs for tests: flown in one process and written byte by byte as the recorder does it.

use autopilot::autopilot::Autopilot;
use autopilot::command::{Command, Intent};
use autopilot::recorder::topics::{self, Place};
use autopilot::recorder::{ControlHeader, Moment, Recorded, RunHash};
use icd::fault::{PlantAction, PlantReport};
use plant_sim::Plant;
use plant_sim::io::header::PlantHeader;
use ulog::writer::{Data, Definitions, Row, Topic, Value};

use lab_judges::closed_loop::FlightSetup;

/// An operator's command, and before which control step it comes.
pub type StepCommand = (u64, Moment, Command);

/// What a log leaves out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Without {
    pub truth: bool,
    pub footer: bool,
    pub headers: bool,
    /// Rows of all but one of so many control steps; 0 for none.
    pub rows: u32,
}

/// Flies a setup and writes its log.
pub fn log(setup: &FlightSetup, commands: &[StepCommand], without: Without) -> Vec<u8> {
    let mut plant = Plant::new(&setup.plant).unwrap();
    let settings = setup.settings();
    let period_us = setup.plant.period.as_micros();
    let control = ControlHeader {
        row_every: without.rows.max(1),
        ..ControlHeader::new(settings.clone(), "00000007".to_owned(), period_us, false)
    };
    let header = PlantHeader::new("a test", &setup.plant);
    let mut writer = Writer::new(without, &control, &header);
    let mut autopilot = Autopilot::new(&settings);
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    let mut commands = commands.iter().zip(1..).peekable();
    let mut reply = None;
    let mut hash = RunHash::default();
    loop {
        let time = plant.time();
        let sensors = plant.sense();
        if plant.on_ground() || time > setup.duration {
            break;
        }
        if hash.steps().is_multiple_of(20) {
            writer.data.sync().unwrap();
        }
        let mut exchange = |moment: Moment,
                            autopilot: &mut Autopilot,
                            plant: &mut Plant,
                            hash: &mut RunHash| {
            let step = hash.steps();
            let place = Place { time, step, moment };
            while let Some(report) = reply.take().or_else(|| plant.pop_report()) {
                if let PlantReport::Fault(entry) = &report {
                    topics::fault_row(&mut writer.row, time, entry);
                    writer.data.row(writer.fault, &writer.row).unwrap();
                }
                autopilot.handle_report(&report);
            }
            while let Some(((_, _, command), number)) =
                commands.next_if(|((at, when, _), _)| *at == step && *when == moment)
            {
                let intent = Intent { number, command: command.clone() };
                writer.recorded(place, &Recorded::Intent(intent.clone()));
                autopilot.handle_intent(intent);
            }
            let actuators = if moment == Moment::Step {
                let log = *autopilot.step(time, &sensors);
                let is_due = step.is_multiple_of(without.rows.max(1).into());
                hash.step(time, &sensors, &log.actuators(), 8);
                let row = &mut writer.row;
                if hash.steps().is_multiple_of(50) {
                    topics::hash_row(row, time, hash);
                    writer.data.row(writer.hash, row).unwrap();
                }
                if is_due {
                    topics::sensors_row(row, time, &sensors);
                    writer.data.row(writer.sensors, row).unwrap();
                    topics::commands_row(row, time, &log.actuators(), 8);
                    writer.data.row(writer.commands, row).unwrap();
                    topics::control_row(row, time, &log, 8);
                    writer.data.row(writer.control, row).unwrap();
                    let snapshot = autopilot.snapshot().unwrap();
                    let references =
                        [snapshot.demand.altitude_m, 0.0, snapshot.demand.airspeed_m_s];
                    topics::vehicle_row(row, time, snapshot.mode, references, snapshot.terminated);
                    writer.data.row(writer.vehicle, row).unwrap();
                    if let Some(estimate) = &log.state.estimate {
                        topics::estimator_status_row(row, time, estimate);
                        writer.data.row(writer.estimate, row).unwrap();
                    }
                    if let Some(truth) = writer.truth {
                        let values = plant.truth().to_row(plant.on_ground(), plant.is_broken());
                        topics::truth_row(row, time, &values);
                        writer.data.row(truth, row).unwrap();
                    }
                }
                log.actuators()
            } else {
                autopilot.hold(&sensors, false)
            };
            if let Some(request) = autopilot.next_request() {
                writer.recorded(place, &Recorded::Request(request));
                hash.request(step, moment, &request.action);
                match request.action {
                    PlantAction::Fault(fault) => {
                        let answer = plant.request(&fault);
                        let number = request.number;
                        reply = Some(PlantReport::FaultReply { request: number, reply: answer });
                    }
                    PlantAction::ListFaults => plant.list_faults(),
                    PlantAction::Pace(pace) => {
                        let request = Some(request.number);
                        reply = Some(PlantReport::Paced { request, pace, at: time });
                    }
                    PlantAction::Restart => {}
                }
            }
            while autopilot.pop_event().is_some() {}
            actuators
        };
        let mut actuators = exchange(Moment::Step, &mut autopilot, &mut plant, &mut hash);
        for _ in 0..3 {
            actuators = exchange(Moment::Holding, &mut autopilot, &mut plant, &mut hash);
        }
        plant.advance(&actuators);
    }
    writer.finish(&hash, without)
}

struct Writer {
    data: Data<Vec<u8>>,
    row: Row,
    sensors: Topic,
    commands: Topic,
    control: Topic,
    vehicle: Topic,
    fault: Topic,
    recorded: Topic,
    hash: Topic,
    estimate: Topic,
    truth: Option<Topic>,
}

impl Writer {
    fn new(without: Without, control: &ControlHeader, plant: &PlantHeader) -> Self {
        let effectors = &control.settings.model.effectors.list;
        let formats = [
            topics::sensors(),
            topics::commands(effectors),
            topics::control(effectors),
            topics::vehicle(),
            topics::fault(),
            topics::recorded(),
            topics::truth(effectors),
            topics::hash(),
            topics::estimator_status(),
        ];
        let mut log = Definitions::begin(Vec::new(), 0).unwrap();
        log.info("sys_name", Value::Text("Two-Step")).unwrap();
        log.info("ver_sw", Value::Text(&control.version)).unwrap();
        log.info("ver_wire", Value::U64(control.wire_version.into())).unwrap();
        if !without.headers {
            let json = serde_json::to_string(control).unwrap();
            log.info("control_header", Value::Text(&json)).unwrap();
        }
        for format in &formats {
            log.format(format).unwrap();
        }
        let mut data = log.data();
        let [sensors, commands, control, vehicle, fault, recorded, truth, hash, estimate] =
            &formats;
        let writer = Self {
            row: Row::default(),
            sensors: data.subscribe(sensors).unwrap(),
            commands: data.subscribe(commands).unwrap(),
            control: data.subscribe(control).unwrap(),
            vehicle: data.subscribe(vehicle).unwrap(),
            fault: data.subscribe(fault).unwrap(),
            recorded: data.subscribe(recorded).unwrap(),
            hash: data.subscribe(hash).unwrap(),
            estimate: data.subscribe(estimate).unwrap(),
            truth: (!without.truth).then(|| data.subscribe(truth).unwrap()),
            data,
        };
        writer.plant(without, plant)
    }

    fn plant(mut self, without: Without, plant: &PlantHeader) -> Self {
        if !without.headers {
            let json = serde_json::to_string(plant).unwrap();
            self.data.info("plant_header", Value::Text(&json)).unwrap();
        }
        self
    }

    fn recorded(&mut self, place: Place, what: &Recorded) {
        let json = serde_json::to_vec(what).unwrap();
        let pieces = json.chunks(topics::PIECE_CHARS);
        let parts = u16::try_from(pieces.len()).unwrap();
        for (part, piece) in (0..parts).zip(pieces) {
            topics::recorded_row(&mut self.row, place, part, parts, piece);
            self.data.row(self.recorded, &self.row).unwrap();
        }
    }

    fn finish(mut self, hash: &RunHash, without: Without) -> Vec<u8> {
        if !without.footer {
            self.data.info("run_hash", Value::Text(&hash.hex())).unwrap();
            self.data.info("control_steps", Value::U64(hash.steps())).unwrap();
            self.data.info("end", Value::Text("stopped")).unwrap();
        }
        self.data.finish().unwrap()
    }
}
