use super::*;
use autopilot::io::status::References;
use icd::SimTime;
use plant_sim::ReadAirframe as _;
use std::net::SocketAddr;

const WIDTHS: [usize; 5] = [40, 60, 80, 110, 200];

/// Healthy, at 12.34 s.
pub(in super::super) fn flight() -> FlightStatus {
    FlightStatus {
        plant: PlantState::Flying,
        t_s: 12.34,
        altitude_m: 5_000.4,
        airspeed_m_s: 264.0,
        roll_deg: -0.25,
        references: References { altitude_m: 6_000.0, airspeed_m_s: 264.0, roll_deg: 0.0 },
        compensator_off: false,
        compensator_active: false,
        fade: 0.0,
        level: 0.05,
        adds: Vec::new(),
        authority_pct: [100.0, 99.0, 98.0],
        faults: Vec::new(),
        more_faults: 0,
        mode: "Hold".to_owned(),
    }
}

pub(in super::super) fn faults(count: usize) -> Vec<FaultStatus> {
    let what = "left elevator stuck at 30.0 deg".to_owned();
    let state = FaultState::Active { since: SimTime::from_micros(3_000_000) };
    vec![FaultStatus { what, state }; count]
}

fn state(flight: FlightStatus) -> ScreenState {
    let mut state = ScreenState::new(PaceState { paused: false, speed: Some(1.0) });
    let at = |port| SocketAddr::from(([127, 0, 0, 1], port));
    state.stations = Some(Listening {
        clients: vec![at(14_550), at(14_540)],
        udp_server: Some(at(18_570)),
        tcp_server: Some(at(5_760)),
    });
    state.advice = Advice::of(&Airframe::paper());
    state.flight = Some(flight);
    state.keys = true;
    for n in 0..30 {
        state.message(&format!("autopilot:  WARN message {n} {}", "of many words ".repeat(20)));
    }
    state
}

fn texts(lines: &[Line]) -> Vec<&str> {
    lines.iter().map(|line| line.text.as_str()).collect()
}

#[test]
fn no_line_is_wider_and_no_screen_higher_than_the_terminal() {
    let mut broken = flight();
    (broken.faults, broken.more_faults) = (faults(8), 12);
    for width in WIDTHS.into_iter().chain([1, 10, 20]) {
        for height in [1, 2, 5, 10, 24, 50] {
            for flight in [flight(), broken.clone()] {
                let lines = state(flight).lines(width, height);
                assert_eq!(lines.len(), height, "{width} x {height}");
                for line in &lines {
                    assert!(columns(&line.text) <= width, "{width}: {:?}", line.text);
                }
            }
        }
    }
}

#[test]
fn on_80_by_24_everything_is_there_and_each_command_is_a_whole_line() {
    let mut broken = flight();
    (broken.faults, broken.more_faults, broken.compensator_active) = (faults(8), 12, true);
    broken.fade = 1.0;
    for flight in [flight(), broken] {
        let state = state(flight);
        let lines = state.lines(80, 24);
        let texts = texts(&lines);
        for command in [
            "  mavproxy.py --master=udpin:127.0.0.1:14550",
            "  python3 gcs-scripts/break_elevator.py",
            "  fail left elevator stuck at 30 deg",
            "  long USER_1 102 2 3 1 30 0 0",
        ] {
            assert!(texts.contains(&command), "{command:?} is missing: {texts:#?}");
        }
        let keys =
            "space pause   s step   S 100 steps   - slower   + faster   1 real time   q quit";
        assert_eq!(texts.last(), Some(&keys), "below, in one line");
        assert!(texts.iter().any(|text| text.contains("message 29")), "the newest: {texts:#?}");
    }
}

#[test]
fn commands_for_a_shell_are_whole_at_60_columns_and_at_40() {
    let lines = state(flight()).lines(60, 40);
    assert!(texts(&lines).contains(&"  mavproxy.py --master=udpin:127.0.0.1:14550"));
    let lines = state(flight()).lines(40, 60);
    let all = texts(&lines).join("\n");
    assert!(all.contains("  mavproxy.py \\\n  --master=udpin:127.0.0.1:14550\n"), "{all}");
    assert!(all.contains("  fail left elevator stuck at 30 deg\n"), "{all}");
}

#[test]
fn faults_compensator_and_authority_are_shown_as_they_change() {
    let shown = |flight: FlightStatus| texts(&state(flight).lines(80, 24)).join("\n");
    let healthy = shown(flight());
    assert!(healthy.contains("faults      none\n"), "{healthy}");
    assert!(healthy.contains("compensator asleep"), "{healthy}");
    assert!(healthy.contains("  adds, deg nothing\n"), "{healthy}");
    assert!(healthy.contains("authority   roll 100 %   pitch  99 %   yaw  98 %\n"), "{healthy}");
    assert!(healthy.contains("altitude        5000 m      reference     6000 m\n"), "{healthy}");
    let mut broken = flight();
    broken.faults = faults(1);
    (broken.compensator_active, broken.fade, broken.level) = (true, 0.5, 3.25);
    broken.adds = vec![(EffectorKind::Elevator, 3.0), (EffectorKind::NozzlePitch, -12.5)];
    broken.authority_pct = [80.0, 5.0, 100.0];
    let lines = state(broken).lines(80, 24);
    let find = |part: &str| lines.iter().find(|line| line.text.contains(part)).map(|l| l.tone);
    let fault = "faults      left elevator stuck at 30.0 deg, since 3.0 s";
    assert_eq!(find(fault), Some(Tone::Warning), "{lines:#?}");
    assert_eq!(find("compensator ACTIVE 50 %"), Some(Tone::Warning), "{lines:#?}");
    assert!(find("estimate 3.25 of its level").is_some(), "{lines:#?}");
    assert!(find("  adds, deg elevator   3.0   nozzle pitch -12.5").is_some(), "{lines:#?}");
    assert_eq!(find("pitch   5 %"), Some(Tone::Warning), "{lines:#?}");
}

#[test]
fn the_title_has_the_state_of_the_plant_and_the_pace() {
    let title = |plant, paused| {
        let mut state = state(FlightStatus { plant, ..flight() });
        state.pace.paused = paused;
        state.lines(80, 24).swap_remove(0)
    };
    let flying = title(PlantState::Flying, false);
    assert_eq!(flying.text, "Two-Step    flying   Hold   12.3 s   x1.0");
    assert_eq!(
        title(PlantState::Flying, true).text,
        "Two-Step    flying   Hold   12.340 s   PAUSED"
    );
    let lost = title(PlantState::Lost, false);
    assert!(lost.text.contains("PLANT LOST") && lost.tone == Tone::Alarm, "{lost:?}");
    assert!(title(PlantState::OnGround, false).text.contains("ON THE GROUND"));
}

#[test]
fn without_ground_stations_there_is_no_help_and_without_a_flight_it_waits() {
    let mut state = ScreenState::new(PaceState { paused: false, speed: None });
    state.stations = Some(Listening::default());
    let lines = state.lines(80, 24);
    assert!(lines[0].text.contains("waiting for the aircraft"));
    assert!(texts(&lines).iter().all(|text| !text.contains("mavproxy")));
}

#[test]
fn of_too_many_messages_the_newest_stay() {
    let mut state = ScreenState::new(PaceState { paused: false, speed: None });
    for n in 0..MESSAGES_MAX + 5 {
        state.message(&n.to_string());
    }
    assert_eq!(state.messages().count(), MESSAGES_MAX);
    assert_eq!(state.messages().next(), Some("5"));
}
