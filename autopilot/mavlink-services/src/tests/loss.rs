//! Each datagram lost in turn: a client that repeats its requests reaches the same end as without the loss.

use super::world::*;
use ::mavlink::dialects::common::{MavMessage, PARAM_VALUE_DATA};
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Airspeed, Mode, Place};

/// Tries of the client, half a second apart, as MAVSDK has it.
const TRIES: u32 = 4;

/// A link that loses the datagram of one number, both directions counted.
struct Lossy {
    world: World,
    lost: u32,
    count: u32,
}

impl Lossy {
    fn passes(&mut self) -> bool {
        self.count += 1;
        self.count != self.lost
    }

    /// Sends until an answer comes that `is_answer`.
    fn converse(&mut self, datagram: &[u8], is_answer: impl Fn(&Got) -> bool) {
        for _ in 0..TRIES {
            self.world.got.clear();
            if self.passes() {
                self.world.send_bytes(address(14_550), datagram);
            }
            self.world.run_ms(500);
            let answers = self.world.got.iter().filter(|got| got.to == address(14_550));
            let answers = answers.filter(|got| is_answer(got)).count();
            if (0..answers).any(|_| self.passes()) {
                return;
            }
        }
        panic!("no answer after {TRIES} tries, datagram {} lost", self.lost);
    }
}

fn is_ack(command: u16) -> impl Fn(&Got) -> bool {
    move |got| got.id == 77 && got.payload[..2] == command.to_le_bytes()
}

/// End of a conversation.
#[derive(Debug, PartialEq)]
struct End {
    parameters: Parameters,
    mode: Mode,
    altitude_m: f64,
    airspeed_m_s: f64,
    /// Centre of the circle.
    centre: Option<Place>,
    bandwidth_of_the_laws: Option<f64>,
}

fn final_state(lost: u32) -> (End, u32) {
    let mut link = Lossy { world: World::flying(), lost, count: 0 };
    let all = crate::codec::Identity { system: 1, component: 1 };
    let mode = command_long(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0], all);
    link.converse(&mode, is_ack(176));
    let climb = command_long(186, [6_000.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0], all);
    link.converse(&climb, is_ack(186));
    let go =
        command_int(192, 0, [-1.0, 1.0, 0.0, f32::NAN], [349_500_000, -1_178_500_000], 6_500.0);
    link.converse(&go, is_ack(192));
    let faster = command_long(178, [0.0, 280.0, -1.0, 0.0, 0.0, 0.0, 0.0], all);
    link.converse(&faster, is_ack(178));
    let fault = command_long(420, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0], all);
    link.converse(&fault, is_ack(420));
    for (name, value) in [("OBS_W0", 40.0), ("REF_ALT_MAX", 9_000.0)] {
        let set: MavMessage = super::params::set_real(name, value);
        let bytes = link.world.encode(STATION, &set);
        link.converse(&bytes, |got| {
            got.read::<PARAM_VALUE_DATA>()
                .is_some_and(|echo| echo.param_id.to_str() == Ok(name) && echo.param_value == value)
        });
    }
    link.world.step();
    let snapshot = *link.world.autopilot.snapshot().unwrap();
    let mut bandwidths =
        link.world.take_commands().into_iter().filter_map(|command| match command {
            Command::Configuration(Configuration::Gains(gains)) => Some(gains.neso.bandwidth),
            _ => None,
        });
    let end = End {
        parameters: *link.world.ground.parameters(),
        mode: snapshot.mode,
        altitude_m: snapshot.demand.altitude_m,
        airspeed_m_s: snapshot.demand.airspeed_m_s,
        centre: snapshot.navigation.target.map(|target| target.place),
        bandwidth_of_the_laws: bandwidths.next_back(),
    };
    (end, link.count)
}

#[test]
fn whichever_datagram_is_lost_the_final_state_is_the_same() {
    let (end, count) = final_state(0);
    assert_eq!(
        (end.altitude_m, end.airspeed_m_s),
        (6_500.0, Airspeed::Calibrated(280.0).true_m_s(6_500.0))
    );
    assert_eq!((end.mode, end.bandwidth_of_the_laws), (Mode::Hold, Some(40.0)));
    assert!(end.centre.is_some(), "a place to circle around");
    assert!(count >= 14, "{count} datagrams");
    for lost in 1..=count {
        assert_eq!(final_state(lost).0, end, "datagram {lost} lost");
    }
}
