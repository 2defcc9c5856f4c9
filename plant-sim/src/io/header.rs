//! The plant's data for the recorder of a flight: its setup, in pieces, and the truth of each tick.
//!
//! They go into the envelope of sensor packets while the autopilot's process records; only the recorder opens it.

use icd::fault::SensorKind;
use icd::record::{self, EnvelopeBytes, Piece, TruthRow, effector_field, piece_max};
use serde::{Deserialize, Serialize};

use crate::setup::PlantSetup;

/// After this many envelopes the header is sent again, for a recorder that joined later.
const AGAIN_AFTER: u32 = 5_000;

/// Definition of the plant's side of a flight; JSON in the info message `plant_header` of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantHeader {
    /// Version of this program.
    pub version: String,
    /// Name or file of the scenario.
    pub scenario: String,
    /// The aircraft's sensors in the order of their numbers, each with the names of its signals; the unit is the last word.
    pub sensors: Vec<SensorSignals>,
    /// Names of the commands, one for each effector.
    pub commands: Vec<String>,
    /// Everything that defines the flight.
    pub setup: PlantSetup,
}

/// Signals of a sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensorSignals {
    /// Its name in scenario files.
    pub sensor: String,
    /// Names of its numbers.
    pub signals: Vec<String>,
}

impl PlantHeader {
    /// Of a flight of this program.
    pub fn new(scenario: &str, setup: &PlantSetup) -> Self {
        let effectors = &setup.airframe.effectors;
        let fitted = setup.sensors.of(&setup.airframe, setup.ground.is_some());
        let sensors = SensorKind::ALL.into_iter().filter(|kind| fitted[*kind as usize]);
        let sensors = sensors.map(|kind| SensorSignals {
            sensor: kind.key().to_owned(),
            signals: kind.signals().iter().map(|name| (*name).to_owned()).collect(),
        });
        let command = |effector| effector_field("", effectors, effector).to_string();
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: scenario.to_owned(),
            sensors: sensors.collect(),
            commands: effectors.all().map(command).collect(),
            setup: setup.clone(),
        }
    }
}

/// Fills envelopes for the recorder of one flight.
#[derive(Debug)]
pub(super) struct Envelopes {
    /// The header as JSON.
    json: Vec<u8>,
    /// Envelopes since the recording began, from 0 again after [`AGAIN_AFTER`].
    sent: u32,
    /// The next packet shall carry one.
    is_recorded: bool,
    bytes: EnvelopeBytes,
}

impl Envelopes {
    /// For a process that flies this setup.
    pub(super) fn new(scenario: &str, setup: &PlantSetup) -> serde_json::Result<Self> {
        let json = serde_json::to_vec(&PlantHeader::new(scenario, setup))?;
        Ok(Self { json, sent: 0, is_recorded: true, bytes: EnvelopeBytes::new() })
    }

    /// Begins a flight: its first packet has an envelope, so that a log has the truth of the first tick.
    pub(super) fn begin_flight(&mut self) {
        self.sent = 0;
        self.is_recorded = true;
    }

    /// Whether the flight is recorded, from the autopilot's last answer.
    pub(super) fn set_recorded(&mut self, is_recorded: bool) {
        self.is_recorded = is_recorded;
        if !is_recorded {
            // A recording that begins later gets the header from its first piece on.
            self.sent = 0;
        }
    }

    /// The envelope of the next packet; empty while the flight is not recorded.
    pub(super) fn next(&mut self, truth: impl FnOnce() -> TruthRow) -> &[u8] {
        if !self.is_recorded {
            return &[];
        }
        let truth = truth();
        let mut pieces = self.json.chunks(piece_max(truth.len()));
        let count = u16::try_from(pieces.len()).unwrap_or(u16::MAX);
        let piece = u16::try_from(self.sent).ok().filter(|index| *index < count);
        let piece = piece.and_then(|index| {
            let bytes = pieces.nth(usize::from(index))?;
            Some(Piece { index, count, bytes })
        });
        record::seal(&truth, piece, &mut self.bytes);
        self.sent = (self.sent + 1) % AGAIN_AFTER;
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airframe;
    use crate::airframe_file::ReadAirframe as _;
    use crate::scenario::Scenario;
    use icd::ControlPeriod;
    use scenarios::CASE1;

    fn setup() -> PlantSetup {
        let plant =
            Scenario::from_toml("case1", CASE1, &Airframe::paper().effectors).unwrap().plant;
        plant.setup(Airframe::paper(), 3, ControlPeriod::DEFAULT, 1_000)
    }

    /// The header that the next envelopes carry, and their number.
    fn collect(envelopes: &mut Envelopes) -> (PlantHeader, usize) {
        let mut json = Vec::new();
        for number in 1.. {
            let bytes = envelopes.next(|| [0.5; 59].into_iter().collect());
            let (truth, piece) = record::open(bytes).unwrap();
            assert_eq!(truth[0], 0.5);
            let piece = piece.unwrap();
            assert_eq!(usize::from(piece.index) + 1, number);
            json.extend_from_slice(piece.bytes);
            if piece.index + 1 == piece.count {
                return (serde_json::from_slice(&json).unwrap(), number);
            }
        }
        unreachable!("the loop has no end")
    }

    #[test]
    fn the_setup_comes_through_the_envelopes_bit_for_bit() {
        let setup = setup();
        let mut envelopes = Envelopes::new("case1", &setup).unwrap();
        let (header, pieces) = collect(&mut envelopes);
        assert_eq!((header.scenario.as_str(), &header.setup), ("case1", &setup));
        // All but those of ground and tank.
        assert_eq!(header.sensors.len(), SensorKind::ALL.len() - 3);
        assert_eq!(header.sensors[6].signals, SensorKind::Vanes.signals());
        assert_eq!(header.commands.len(), 8);
        assert_eq!(header.commands[7], "engine_n");
        // Then only the truth, until the header is due again.
        for _ in pieces..AGAIN_AFTER as usize {
            let bytes = envelopes.next(|| [0.0; 59].into_iter().collect());
            assert_eq!(record::open(bytes).unwrap().1, None);
        }
        assert_eq!(collect(&mut envelopes).0, header);
    }

    #[test]
    fn after_the_first_packet_nothing_is_sent_without_a_recorder_and_a_late_recorder_gets_all() {
        let mut envelopes = Envelopes::new("case1", &setup()).unwrap();
        let truth = || [0.0; 59].into_iter().collect();
        assert!(!envelopes.next(truth).is_empty());
        envelopes.set_recorded(false);
        assert_eq!(envelopes.next(|| unreachable!("not recorded")), &[0_u8; 0]);
        envelopes.set_recorded(true);
        assert_eq!(collect(&mut envelopes).0.setup, setup());
        envelopes.set_recorded(false);
        envelopes.begin_flight();
        assert!(!envelopes.next(truth).is_empty());
    }
}
