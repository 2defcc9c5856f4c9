//! The run hash of a flight: equal where sensors, commands and requests were equal bit for bit.

use icd::fault::PlantAction;
use icd::{Actuators, Sensors, SimTime, Stamp};
use sha2::{Digest, Sha256};

use super::Moment;

/// Tag of the aircraft's sensors and effectors.
const AIRCRAFT: u8 = 0;
/// Tag of a control step.
const STEP: u8 = 1;
/// Tag of a request sent to the plant.
const REQUEST: u8 = 2;
/// Tag of the stamp of a sample.
const SAMPLE: u8 = 3;

/// SHA-256 over the flight, in order.
///
/// ```text
/// aircraft:     0x00, number of sensors u8, for each its kind u8 and the count of its numbers u8, number of effectors u8
/// control step: 0x01, time us u64, numbers of the sensors f64, commands f64       (little endian, as on the link)
/// sample:       0x03, kind of sensor u8, valid u8, time us u64   (after its step, unless it is a valid one of the step's time)
/// request:      0x02, control steps flown u64, moment u8, the action (postcard)
/// ```
///
/// The aircraft comes before the first control step. A sensor that the aircraft lacks is left out, and so is everything that depends
/// on wall time: session, pauses and speeds, repeated packets.
#[derive(Debug, Clone, Default)]
pub struct RunHash {
    sha: Sha256,
    steps: u64,
}

impl RunHash {
    /// Adds a control step: sensor values, and the commands of the aircraft's effectors.
    pub fn step(
        &mut self,
        time: SimTime,
        sensors: &Sensors,
        actuators: &Actuators,
        effectors: usize,
    ) {
        if self.steps == 0 {
            self.aircraft(sensors, effectors);
        }
        self.steps += 1;
        self.sha.update([STEP]);
        self.sha.update(time.as_micros().to_le_bytes());
        let (values, stamps) = (sensors.to_array(), sensors.stamps());
        let values = sensors.present().flat_map(|sensor| &values[sensor.places()]);
        for value in values.chain(actuators.commands.first(effectors)) {
            self.sha.update(value.to_le_bytes());
        }
        // Closed brakes are of a flight over a ground; others keep their hash.
        if actuators.brakes != 0.0 {
            self.sha.update(actuators.brakes.to_le_bytes());
        }
        let now = Stamp { time, valid: true };
        for sensor in sensors.present() {
            let stamp = stamps[sensor as usize];
            if stamp != now {
                self.sha.update([SAMPLE, sensor as u8, u8::from(stamp.valid)]);
                self.sha.update(stamp.time.as_micros().to_le_bytes());
            }
        }
    }

    // Few sensors, numbers and effectors.
    fn aircraft(&mut self, sensors: &Sensors, effectors: usize) {
        self.sha.update([AIRCRAFT, sensors.present().count() as u8]);
        for sensor in sensors.present() {
            self.sha.update([sensor as u8, sensor.signals().len() as u8]);
        }
        self.sha.update([effectors as u8]);
    }

    /// Adds a request sent to the plant after `steps_flown` control steps.
    pub fn request(&mut self, steps_flown: u64, moment: Moment, action: &PlantAction) {
        // Depends on wall time; a replay flies without pauses and as fast as it can.
        if matches!(action, PlantAction::Pace(_)) {
            return;
        }
        self.sha.update([REQUEST]);
        self.sha.update(steps_flown.to_le_bytes());
        self.sha.update([moment.code()]);
        // Plain data of a known size: it always fits.
        let mut scratch = [0; 256];
        if let Ok(bytes) = postcard::to_slice(action, &mut scratch) {
            self.sha.update(bytes);
        }
    }

    /// Control steps so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The hash so far, 64 hexadecimal digits.
    pub fn hex(&self) -> String {
        hex(&self.sha.clone().finalize())
    }
}

/// Hexadecimal digits of bytes.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::pace::Pace;
    use icd::sensors::SensorKind;
    use icd::tvc_jet;
    use icd::{FaultRequest, PerEffector};

    /// Without the sensors of ground and tank.
    fn in_the_air(mut sensors: Sensors) -> Sensors {
        sensors.keep(&SensorKind::ALL.map(|kind| kind <= SensorKind::Magnetometer));
        sensors
    }

    fn flown(last: f64, action: &PlantAction) -> RunHash {
        let mut values = [0.25; Sensors::COUNT];
        values[6..10].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        values[SensorKind::EngineMonitor.places()].fill(last);
        let at = |micros| in_the_air(Sensors::at(SimTime::from_micros(micros), &values));
        let actuators = Actuators::new(PerEffector::from_values([-1.5; 8]));
        let mut hash = RunHash::default();
        hash.step(SimTime::ZERO, &at(0), &actuators, 8);
        hash.request(0, Moment::Step, action);
        hash.step(SimTime::from_micros(2_000), &at(2_000), &actuators, 8);
        hash
    }

    /// An aircraft with all sensors of the air.
    fn aircraft(effectors: u8) -> Vec<u8> {
        let sensors = [[0, 3], [1, 3], [2, 4], [3, 10], [4, 2], [5, 2], [6, 2], [7, 1], [8, 3]];
        [&[0, 9][..], &sensors.concat(), &[effectors]].concat()
    }

    #[test]
    fn the_hash_is_that_of_the_documented_bytes() {
        let action = PlantAction::Fault(FaultRequest::Clear { target: tvc_jet::RUDDER.into() });
        let hash = flown(3.0, &action);
        let mut bytes = aircraft(8);
        for time in [0_u64, 2_000] {
            bytes.push(1);
            bytes.extend(time.to_le_bytes());
            for index in 0..30 {
                let value: f64 = match index {
                    6 => 1.0,
                    7..10 => 0.0,
                    26 => 3.0,
                    _ => 0.25,
                };
                bytes.extend(value.to_le_bytes());
            }
            bytes.extend([(-1.5_f64).to_le_bytes(); 8].concat());
            if time == 0 {
                bytes.push(2);
                bytes.extend([0; 9]);
                // Fault, Clear, Rudder.
                bytes.extend([0, 1, 4]);
            }
        }
        assert_eq!(hash.hex(), hex(&Sha256::digest(&bytes)));
        assert_eq!(hash.steps(), 2);
        assert_eq!(hash.hex(), VECTOR);
    }

    #[test]
    fn a_sample_that_is_old_or_not_valid_changes_the_hash_by_its_documented_bytes() {
        let time = SimTime::from_micros(2_000);
        let mut sensors = in_the_air(Sensors::at(time, &[0.5; Sensors::COUNT]));
        let of = |sensors: &Sensors| {
            let mut hash = RunHash::default();
            hash.step(time, sensors, &Actuators::default(), 0);
            hash.hex()
        };
        let step = [&[1][..], &2_000_u64.to_le_bytes(), &[0.5_f64.to_le_bytes(); 30].concat()];
        let ideal = [aircraft(0), step.concat()];
        assert_eq!(of(&sensors), hex(&Sha256::digest(ideal.concat())));
        sensors.gnss.time = SimTime::from_micros(1_000);
        sensors.engine_n.valid = false;
        let gnss = [&[3, 3, 1][..], &1_000_u64.to_le_bytes()].concat();
        let engine = [&[3, 7, 0][..], &2_000_u64.to_le_bytes()].concat();
        assert_eq!(of(&sensors), hex(&Sha256::digest([ideal.concat(), gnss, engine].concat())));
    }

    #[test]
    fn a_sensor_that_the_aircraft_lacks_is_not_hashed() {
        let time = SimTime::from_micros(2_000);
        let mut sensors = Sensors::at(time, &[0.5; Sensors::COUNT]);
        sensors.keep(&SensorKind::ALL.map(|kind| kind == SensorKind::Vanes));
        let mut hash = RunHash::default();
        hash.step(time, &sensors, &Actuators::default(), 2);
        let step = [&[1][..], &2_000_u64.to_le_bytes(), &[0.5_f64.to_le_bytes(); 2].concat()];
        let bytes = [&[0, 1, 6, 2, 2][..], &step.concat(), &[0; 16]].concat();
        assert_eq!(hash.hex(), hex(&Sha256::digest(bytes)));
    }

    /// Fixed, so that logs of different versions can be compared.
    const VECTOR: &str = "0e34e88b23572767ab90ccc1f9c0c4c5163c56acaa12b9693a307e811c240da1";

    #[test]
    fn one_bit_changes_the_hash_and_a_pace_does_not() {
        let list = flown(3.0, &PlantAction::ListFaults);
        assert_ne!(list.hex(), flown(3.0_f64.next_up(), &PlantAction::ListFaults).hex());
        let paced = flown(3.0, &PlantAction::Pace(Pace::Run));
        assert_eq!(paced.hex(), flown(3.0, &PlantAction::Pace(Pace::Pause)).hex());
        assert_ne!(paced.hex(), list.hex());
    }
}
