use super::*;
use crate::effector_list::PerEffector;
use crate::fault::{
    FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset, PlantAction, Quantity,
    Refusal, Repeat, Side, Timing, Travel,
};
use crate::frames::Attitude;
use crate::pace::Pace;
use crate::tvc_jet;
use proptest::prelude::*;

/// Every sensor with a different time, every other one invalid.
fn sensors() -> Sensors {
    let mut values = core::array::from_fn(|index| index as f64 / 3.0);
    values[6..10].copy_from_slice(&Attitude::from_quaternion(0.9, 0.1, -0.2, 0.3).wxyz());
    let stamp = |sensor: u64| Stamp {
        time: SimTime::from_micros(13_990 + sensor.min(10)),
        valid: sensor.is_multiple_of(2),
    };
    Sensors::new(&std::array::from_fn(|number| stamp(number as u64)), &values)
}

fn full_sensor_packet() -> SensorPacket {
    let at = SimTime::from_micros(7);
    let repeat = Some(Repeat { every_s: 2.0, times: Some(3) });
    let timing = Timing { onset: Onset::At(at), ramp_s: 0.25, duration_s: Some(1.0), repeat };
    let entry = |state| {
        let kind = FaultKind::Intermittent { period_s: 0.5, present: 0.25 };
        PlantReport::Fault(FaultEntry {
            id: 9,
            target: tvc_jet::RUDDER.into(),
            kind,
            timing,
            state,
        })
    };
    let mut reports = Reports::new();
    reports.push(entry(FaultState::Active { since: at }));
    reports.push(entry(FaultState::Resting { since: at, next: SimTime::from_micros(9) }));
    reports.push(entry(FaultState::Scheduled { at }));
    SensorPacket {
        session: 42,
        sequence: 7,
        aircraft: tvc_jet::aircraft(),
        time: SimTime::from_micros(14_000),
        phase: Phase::Flying,
        period: ControlPeriod::DEFAULT,
        sensors: sensors(),
        reports,
    }
}

fn actuator_packet() -> ActuatorPacket {
    ActuatorPacket {
        session: 42,
        sequence: 7,
        aircraft: tvc_jet::aircraft(),
        time: SimTime::from_micros(14_000),
        actuators: Actuators {
            commands: PerEffector::from_values([0.1, -0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 3.0e4]),
            brakes: 0.25,
        },
        request: Some(PlantRequest {
            number: 9,
            action: PlantAction::Fault(FaultRequest::Inject {
                target: tvc_jet::LEFT_ELEVATOR.into(),
                kind: FaultKind::StuckAt { angle_rad: 0.5, travel: Travel::AtActuatorRate },
                timing: Timing::at(SimTime::from_micros(3_000_000)),
            }),
        }),
        wants_envelope: true,
    }
}

#[test]
fn the_largest_packets_fit_and_come_back_bit_for_bit() {
    let mut bytes = PacketBytes::new();
    let packet = full_sensor_packet();
    let sealed = [7; ENVELOPE_MAX];
    encode_sensors(&packet, &sealed, &mut bytes);
    assert!(bytes.len() < PACKET_MAX, "{} bytes", bytes.len());
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet.clone())));
    assert_eq!(envelope(&bytes), sealed);
    encode_sensors(&packet, &[], &mut bytes);
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet)));
    assert_eq!(envelope(&bytes), []);

    let packet = actuator_packet();
    encode_actuators(&packet, &mut bytes);
    assert_eq!(decode(&bytes), Ok(Packet::Actuators(packet)));
}

#[test]
fn every_request_reply_and_report_comes_back_from_the_bytes_of_this_version() {
    // A sensor that came later changes nothing of the bytes without it.
    let of_this_version = || {
        let mut packet = full_sensor_packet();
        packet.sensors.keep(&SensorKind::ALL.map(|kind| kind != SensorKind::FuelGauge));
        packet
    };
    let at = SimTime::from_micros(123);
    let (mut bytes, mut all) = (PacketBytes::new(), std::vec::Vec::new());
    let replies = [
        FaultReply::Applied { at },
        FaultReply::Unchanged { at },
        FaultReply::Scheduled { at },
        FaultReply::Cleared { at },
        FaultReply::Refused(Refusal::NoSuchSensor),
        FaultReply::Refused(Refusal::OnsetInThePast { onset: at, now: SimTime::from_micros(9) }),
        FaultReply::Refused(Refusal::NotForThisEffector),
        FaultReply::Refused(Refusal::ScheduleFull { capacity: 64 }),
        FaultReply::Refused(Refusal::FlightOver),
        FaultReply::Refused(Refusal::NoSuchEffector { count: 8 }),
    ];
    // The plant has a duration in the place of an end, and another refusal for an onset.
    let of_plant = |what: &Quantity| !matches!(what, Quantity::Onset | Quantity::End);
    let ranges = Quantity::ALL.into_iter().filter(of_plant).map(|what| {
        FaultReply::Refused(Refusal::OutOfRange { what, value: 1.5, min: 0.0, max: 1.0 })
    });
    for reply in replies.into_iter().chain(ranges) {
        let mut packet = of_this_version();
        packet.reports.clear();
        packet.reports.push(PlantReport::FaultReply { request: 1, reply });
        packet.reports.push(PlantReport::GroundContact { at });
        encode_sensors(&packet, &[], &mut bytes);
        all.extend_from_slice(&bytes);
        assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet)));
    }
    for (request, pace) in [
        (None, Pace::Pause),
        (Some(0), Pace::Run),
        (Some(u32::MAX), Pace::Step(1)),
        (Some(7), Pace::Speed(0.1)),
    ] {
        let mut packet = of_this_version();
        packet.reports.clear();
        packet.reports.push(PlantReport::Paced { request, pace, at });
        encode_sensors(&packet, &[], &mut bytes);
        all.extend_from_slice(&bytes);
        assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet)));
    }
    for state in [FaultState::Cancelled { at }, FaultState::Active { since: at }] {
        let mut packet = of_this_version();
        packet.reports.clear();
        let (effector, kind) = (tvc_jet::ENGINE, FaultKind::FlameOut);
        let entry = FaultEntry { id: 1, target: effector.into(), kind, timing: Timing::NOW, state };
        packet.reports.push(PlantReport::Fault(entry));
        encode_sensors(&packet, &[], &mut bytes);
        all.extend_from_slice(&bytes);
        assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet)));
    }
    let actions = [
        PlantAction::Restart,
        PlantAction::ListFaults,
        PlantAction::Fault(FaultRequest::ClearAll),
        PlantAction::Pace(Pace::Pause),
        PlantAction::Pace(Pace::Run),
        PlantAction::Pace(Pace::Step(Pace::STEPS_MAX)),
        PlantAction::Pace(Pace::Speed(Pace::SPEED.0)),
        PlantAction::Fault(FaultRequest::Clear { target: tvc_jet::NOZZLE_YAW.into() }),
        PlantAction::Fault(FaultRequest::Inject {
            target: tvc_jet::ENGINE.into(),
            kind: FaultKind::HardOver { side: Side::Negative },
            timing: Timing::NOW,
        }),
    ];
    for action in actions {
        let packet = ActuatorPacket {
            request: Some(PlantRequest { number: 5, action }),
            ..actuator_packet()
        };
        encode_actuators(&packet, &mut bytes);
        all.extend_from_slice(&bytes);
        assert_eq!(decode(&bytes), Ok(Packet::Actuators(packet)));
    }
    // A change of these bytes is a new version.
    assert_eq!((VERSION, crc32fast::hash(&all)), (10, 1_568_324_699));
}

#[test]
fn a_value_that_is_not_finite_is_named() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    packet.sensors.vanes.value.sideslip_rad = f64::NAN;
    encode_sensors(&packet, &[], &mut bytes);
    match decode(&bytes) {
        Err(WireError::Value { field: "sideslip_rad", session: 42, sequence: 7, .. }) => {}
        other => panic!("{other:?}"),
    }
    let mut packet = actuator_packet();
    packet.actuators.commands[tvc_jet::RUDDER] = f64::INFINITY;
    encode_actuators(&packet, &mut bytes);
    assert!(matches!(decode(&bytes), Err(WireError::Value { field: "value of effector 5", .. })));
}

#[test]
fn a_pace_that_cannot_be_is_refused() {
    let mut bytes = PacketBytes::new();
    let too_many = Pace::Step(Pace::STEPS_MAX + 1);
    let impossible = [Pace::Step(0), too_many, Pace::Speed(0.0), Pace::Speed(-1.0)];
    for pace in impossible.into_iter().chain([1.0e9, f64::NAN, f64::INFINITY].map(Pace::Speed)) {
        let action = PlantAction::Pace(pace);
        let packet = ActuatorPacket {
            request: Some(PlantRequest { number: 5, action }),
            ..actuator_packet()
        };
        encode_actuators(&packet, &mut bytes);
        let decoded = decode(&bytes);
        assert!(matches!(decoded, Err(WireError::Value { field: "pace", .. })), "{decoded:?}");
    }
    // Half a period: only the envelope flag and the checksum follow the value.
    let action = PlantAction::Pace(Pace::Step(1));
    let packet =
        ActuatorPacket { request: Some(PlantRequest { number: 5, action }), ..actuator_packet() };
    encode_actuators(&packet, &mut bytes);
    let end = bytes.len() - 4;
    bytes[end - 9..end - 1].copy_from_slice(&0.5_f64.to_le_bytes());
    let crc = crc32fast::hash(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    assert!(matches!(decode(&bytes), Err(WireError::Value { field: "pace", .. })));
}

#[test]
fn the_version_that_knows_pace_is_not_the_one_that_did_not() {
    let mut bytes = PacketBytes::new();
    encode_actuators(&actuator_packet(), &mut bytes);
    bytes[4..6].copy_from_slice(&1_u16.to_le_bytes());
    assert!(matches!(decode(&bytes), Err(WireError::Version { theirs: 1, .. })));
}

#[test]
fn an_attitude_that_is_no_rotation_is_refused() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    packet.sensors.attitude.value = Attitude::from_unit_wxyz([0.0, 0.0, 0.0, 0.0]);
    encode_sensors(&packet, &[], &mut bytes);
    assert!(matches!(decode(&bytes), Err(WireError::Value { .. })));
}

#[test]
fn a_sample_of_the_future_is_refused() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    packet.sensors.gnss.time = packet.time;
    encode_sensors(&packet, &[], &mut bytes);
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet.clone())));
    packet.sensors.gnss.time = SimTime::from_micros(14_001);
    encode_sensors(&packet, &[], &mut bytes);
    assert!(matches!(
        decode(&bytes),
        Err(WireError::Value { field: "gnss_time_us", value: 14_001.0, .. })
    ));
}

#[test]
fn only_the_sensors_of_the_aircraft_are_sent_and_an_unknown_one_is_skipped() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    encode_sensors(&packet, &[], &mut bytes);
    let all = bytes.len();
    let lacking = [SensorKind::Attitude, SensorKind::Gnss, SensorKind::Magnetometer];
    packet.sensors.keep(&SensorKind::ALL.map(|kind| !lacking.contains(&kind)));
    encode_sensors(&packet, &[], &mut bytes);
    assert_eq!(bytes.len(), all - 3 * 11 - 8 * (4 + 10 + 3));
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet.clone())));

    // The body: name and effectors of the aircraft, period, number of sensors.
    let number_at = 32 + 1 + packet.aircraft.name.len() + 1 + 4 + 4;
    assert_eq!(bytes[number_at..number_at + 3], [9, 0, 3]);
    let changed = |change: &dyn Fn(&mut std::vec::Vec<u8>)| {
        let mut body = bytes[..bytes.len() - 4].to_vec();
        change(&mut body);
        body.extend(crc32fast::hash(&body).to_le_bytes());
        decode(&body)
    };
    // A sensor of a later version, with two numbers, behind the last one: the fuel is its only number.
    let end = number_at + 1 + 9 * 11 + 8 * (3 + 3 + 2 + 2 + 2 + 1 + 1 + 1 + 1);
    let unknown = changed(&|body| {
        body[number_at] = 10;
        let later = [&[200, 2, 1][..], &7_u64.to_le_bytes(), &[255; 16]].concat();
        body.splice(end..end, later);
    });
    assert_eq!(unknown, Ok(Packet::Sensors(packet.clone())));
    for (at, field) in [(1, "number of a sensor"), (2, "count of a sensor's numbers")] {
        let second = number_at + at + 11 + 8 * 3;
        let wrong = changed(&|body| body[second] = 0);
        assert_eq!(wrong, Err(WireError::Code { field, value: 0 }));
    }
}

#[test]
fn another_version_is_recognised_whatever_follows_it() {
    let mut bytes = PacketBytes::new();
    encode_sensors(&full_sensor_packet(), &[], &mut bytes);
    bytes[4] = 99;
    let expected = WireError::Version { theirs: 99, session: 42, sequence: 7 };
    assert_eq!(decode(&bytes), Err(expected));
}

#[test]
fn a_refusal_is_understood_from_any_version() {
    let mut bytes = PacketBytes::new();
    let refusal =
        RefusalPacket { version: VERSION, session: 1, sequence: 2, reason: RefusalReason::Version };
    encode_refusal(&refusal, &mut bytes);
    assert_eq!(decode(&bytes), Ok(Packet::Refusal(refusal)));
    bytes[4] = 99;
    let end = bytes.len() - 4;
    let crc = crc32fast::hash(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    assert_eq!(decode(&bytes), Ok(Packet::Refusal(refusal)));
}

proptest! {
    #[test]
    fn any_single_damaged_byte_is_noticed(index in 0_usize..200, flip in 1_u8..=255) {
        let mut bytes = PacketBytes::new();
        encode_sensors(&full_sensor_packet(), &[], &mut bytes);
        bytes[index] ^= flip;
        prop_assert!(decode(&bytes).is_err());
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..1500)) {
        let _ = decode(&bytes);
    }

    #[test]
    fn bodies_of_arbitrary_bytes_with_a_right_checksum_never_panic(
        mut bytes in proptest::collection::vec(any::<u8>(), 36..1400),
        kind in 1_u8..4,
    ) {
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
        bytes[6] = kind;
        let end = bytes.len() - 4;
        let crc = crc32fast::hash(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&crc);
        let _ = decode(&bytes);
    }
}

#[test]
fn the_start_comes_back_bit_for_bit_and_only_in_the_first_packet_of_a_flight() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    let positions = PerEffector::from_values([0.1, -0.1, 1.0 / 3.0, -0.2, 0.3, 0.0, -0.0, 2.7e4]);
    packet.reports[0] = PlantReport::Started { positions };
    packet.sequence = 0;
    encode_sensors(&packet, &[7; ENVELOPE_MAX], &mut bytes);
    assert!(bytes.len() < PACKET_MAX, "{} bytes", bytes.len());
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet.clone())));
    packet.sequence = 1;
    encode_sensors(&packet, &[], &mut bytes);
    assert_eq!(decode(&bytes), Err(WireError::Code { field: "report", value: 4 }));
    packet.sequence = 0;
    let mut positions = positions;
    positions[tvc_jet::RUDDER] = f64::NAN;
    packet.reports[0] = PlantReport::Started { positions };
    encode_sensors(&packet, &[], &mut bytes);
    assert!(matches!(decode(&bytes), Err(WireError::Value { field: "value of effector 5", .. })));
}

/// The largest aircraft: every place has an effector, and the name has the largest length.
fn largest() -> Aircraft {
    let name = Name::from("abcdefghijklmnopqrstuvwxyz123456").unwrap();
    Aircraft { name, effectors: 16, identity: u32::MAX }
}

#[test]
fn the_largest_aircraft_fits_and_comes_back_bit_for_bit() {
    let mut bytes = PacketBytes::new();
    let mut packet = full_sensor_packet();
    packet.aircraft = largest();
    packet.sequence = 0;
    let positions = PerEffector::from_fn(|effector| 0.1 * f64::from(effector.code()));
    packet.reports[0] = PlantReport::Started { positions };
    encode_sensors(&packet, &[7; ENVELOPE_MAX], &mut bytes);
    assert!(bytes.len() < PACKET_MAX, "{} bytes", bytes.len());
    assert_eq!(decode(&bytes), Ok(Packet::Sensors(packet)));
    let mut packet = actuator_packet();
    (packet.aircraft, packet.actuators.commands) = (largest(), positions);
    encode_actuators(&packet, &mut bytes);
    assert_eq!(decode(&bytes), Ok(Packet::Actuators(packet)));
}

#[test]
fn only_the_effectors_of_the_aircraft_are_sent_and_their_number_is_checked() {
    let mut bytes = PacketBytes::new();
    let mut packet = actuator_packet();
    encode_actuators(&packet, &mut bytes);
    let eight = bytes.len();
    packet.aircraft.effectors = 7;
    encode_actuators(&packet, &mut bytes);
    assert_eq!(bytes.len() + 8, eight);
    for effectors in [0, 17, 255] {
        packet.aircraft.effectors = effectors;
        encode_actuators(&packet, &mut bytes);
        let expected = WireError::Code { field: "number of effectors", value: effectors };
        assert_eq!(decode(&bytes), Err(expected));
    }
}
