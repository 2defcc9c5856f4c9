//! A sample of the study of false alarms; the whole one is `sitl false-alarms --hours 100` (docs/false-alarms.md).

use sitl::false_alarms::{ALLOWED_PER_H, Options, Shipped, fly_healthy};

#[test]
fn healthy_flight_in_moderate_turbulence_has_no_more_alarms_than_the_stated_rate() {
    let options = Options {
        hours: 3.0,
        turbulence_m_s: 3.0,
        gyro_noise_deg_s: 0.1,
        seed: 1_000,
        out: std::path::PathBuf::new(),
        airframe: None,
    };
    let conditions = fly_healthy(&options).expect("the shipped aircraft flies");
    let Shipped { kind, index } = Shipped::find();
    let (mut alarms, mut hours) = (0, 0.0);
    for at in &conditions {
        assert_eq!(at.lost, 0, "a healthy aircraft was lost");
        // The air reaches the detector: a study of calm air would show nothing.
        assert!(at.rms().min() > 0.05, "z2 over its level {:?}", at.rms());
        // Half of the flight is manoeuvres, less the ten seconds at the start.
        assert!((at.manoeuvring_s / at.seconds - 0.5).abs() < 0.02, "{} s", at.manoeuvring_s);
        alarms += at.alarms[kind][index];
        hours += at.seconds / 3_600.0;
    }
    assert!(hours >= 3.0, "{hours} h");
    let rate = f64::from(alarms) / hours;
    assert!(rate <= ALLOWED_PER_H, "{alarms} alarms in {hours} h");
}
