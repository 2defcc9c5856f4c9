//! Messages without effect: requests, noise, and commands for another vehicle.

use mavlink::calculate_crc;

/// First command number that no definition has.
pub const FIRST_UNKNOWN: u16 = 50_000;

const PING: (u8, u8) = (4, 237);
const SET_MODE: (u8, u8) = (11, 89);
const PARAM_REQUEST_READ: (u8, u8) = (20, 214);
const PARAM_REQUEST_LIST: (u8, u8) = (21, 159);
const PARAM_SET: (u8, u8) = (23, 168);
const MISSION_REQUEST_LIST: (u8, u8) = (43, 132);
const COMMAND_LONG: (u8, u8) = (76, 152);
const FTP: (u8, u8) = (110, 84);
const TIMESYNC: (u8, u8) = (111, 34);

/// MAV_CMD_REQUEST_MESSAGE, MAV_CMD_USER_1.
const REQUEST_MESSAGE: u16 = 512;
const USER_1: u16 = 31_010;

/// The vehicle, and one that does not exist.
const US: [u8; 2] = [1, 1];
const ELSEWHERE: [u8; 2] = [42, 1];

/// A frame with this id and extra checksum, MAVLink 2.
fn frame((id, extra_crc): (u8, u8), payload: &[u8]) -> Vec<u8> {
    let length = u8::try_from(payload.len()).expect("at most 255");
    let mut frame = vec![0xFD, length, 0, 0, 0, 250, 190, id, 0, 0];
    frame.extend_from_slice(payload);
    let crc = calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

/// The same in MAVLink 1.
fn frame_1((id, extra_crc): (u8, u8), payload: &[u8]) -> Vec<u8> {
    let length = u8::try_from(payload.len()).expect("at most 255");
    let mut frame = vec![0xFE, length, 0, 250, 190, id];
    frame.extend_from_slice(payload);
    let crc = calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

fn command(number: u16, params: [f32; 7], target: [u8; 2]) -> Vec<u8> {
    let mut payload: Vec<u8> = params.iter().flat_map(|value| value.to_le_bytes()).collect();
    payload.extend_from_slice(&number.to_le_bytes());
    payload.extend_from_slice(&target);
    payload.push(0);
    frame(COMMAND_LONG, &payload)
}

/// A command that no definition has.
pub fn unknown_command(number: u16) -> Vec<u8> {
    command(FIRST_UNKNOWN + number, [0.0; 7], US)
}

/// An endless sequence of messages, the same for the same seed.
pub struct Source {
    state: u64,
}

impl Source {
    /// A seed other than zero.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Xorshift64.
    fn random(&mut self) -> u64 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        self.state
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.random().to_le_bytes()[0]).collect()
    }

    /// One message, valid or malformed.
    pub fn next(&mut self) -> Vec<u8> {
        let word = self.random();
        let [low, high, ..] = word.to_le_bytes();
        let number = u16::from_le_bytes([low, high]) % 1_000;
        match self.random() % 17 {
            0..=1 => self.parameter_question(low),
            2..=3 => {
                let id = [148.0, 300.0, 435.0, 397.0, 245.0, f32::NAN][usize::from(low % 6)];
                command(REQUEST_MESSAGE, [id, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], US)
            }
            4 => frame(PING, &[&word.to_le_bytes()[..], &[1, 0, 0, 0, 0, 0]].concat()),
            5 => frame(TIMESYNC, &[&[0; 8][..], &word.to_le_bytes()].concat()),
            6 => frame(MISSION_REQUEST_LIST, &[US[0], US[1], low % 3]),
            7..=8 => unknown_command(number),
            9..=10 => self.bytes(1 + usize::from(low) * 4),
            11 => {
                // The beginning of a message that would change the flight.
                let mut whole = self.command(US);
                whole.truncate(usize::from(low) % whole.len());
                whole
            }
            12 => {
                let mut damaged = self.command(US);
                let last = damaged.len() - 1;
                damaged[last] ^= 1 + low % 255;
                damaged
            }
            13 => frame(FTP, &[&[0, US[0], US[1]][..], &self.bytes(251)].concat()),
            14 => {
                // Longer than the message, and than a single read.
                let mut long = frame(PING, &self.bytes(255));
                long.extend(self.bytes(3_000));
                long
            }
            _ => self.command(ELSEWHERE),
        }
    }

    fn parameter_question(&mut self, low: u8) -> Vec<u8> {
        if low == 0 {
            return frame(PARAM_REQUEST_LIST, &US);
        }
        let mut payload = vec![low % 60, 0, US[0], US[1]];
        payload.extend_from_slice(&[0; 16]);
        if low.is_multiple_of(2) {
            frame(PARAM_REQUEST_READ, &payload)
        } else {
            frame_1(PARAM_REQUEST_READ, &payload)
        }
    }

    /// Messages that would change the flight if they were addressed to this vehicle.
    fn command(&mut self, target: [u8; 2]) -> Vec<u8> {
        match self.random() % 4 {
            0 => command(USER_1, [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 0.0], target),
            1 => frame(SET_MODE, &[0, 0, 6, 0, target[0], 1]),
            2 => {
                let mut payload = 60.0_f32.to_le_bytes().to_vec();
                payload.extend_from_slice(&target);
                payload.extend_from_slice(b"OBS_W0\0\0\0\0\0\0\0\0\0\0\x09");
                frame(PARAM_SET, &payload)
            }
            _ => command(246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], target),
        }
    }
}
