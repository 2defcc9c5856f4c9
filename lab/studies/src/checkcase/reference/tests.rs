//! The rule of the comparison on small data of its own.

use std::fs;

use super::*;

const MANIFEST: &str = r#"{
  "floors": {"pos_n": 0.01, "pos_e": 0.01, "alt": 0.01, "vn": 0.001, "ve": 0.001, "vd": 0.001, "att": 0.001},
  "cases": {"7": {
    "title": "a case", "earth": "wgs84", "sims": ["04", "05", "06"],
    "core": {"pos": ["04", "05"], "vel": ["04", "05", "06"], "att": ["05"]},
    "tight_tol": {"alt": 0.5}
  }}
}"#;
const HEADER: &str = "time_s,lat_deg,lon_deg,alt_m,vn_mps,yaw_deg,pitch_deg,roll_deg";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("manifest.json"), MANIFEST).unwrap();
    fs::create_dir(folder.path().join("7")).unwrap();
    for (sim, rows) in [
        ("04", "0,0,179.9999,100,0,0,0,0\n1,0,179.9999,101,3,0,0,0"),
        ("05", "0,0,-179.9999,100,0,10,0,0\n1,0,-179.9999,103,1,10,0,0"),
        ("06", "0,0,180,100,0,0,0,0\n1,0,180,150,2,0,0,0"),
    ] {
        let path = folder.path().join("7").join(format!("sim_{sim}.csv"));
        fs::write(path, format!("{HEADER}\n{rows}\n")).unwrap();
    }
    folder
}

fn deviations(rows: &str) -> Vec<Deviation> {
    let folder = folder();
    let references = References::open(folder.path()).unwrap();
    let ours = Trajectory::read("ours.csv", &format!("{HEADER}\n{rows}\n")).unwrap();
    references.case("7").unwrap().deviations(&ours).unwrap()
}

fn of<'a>(all: &'a [Deviation], name: &str) -> &'a Deviation {
    all.iter().find(|one| one.quantity.name == name).unwrap()
}

#[test]
fn the_error_is_that_from_the_mean_of_the_core_and_twice_its_spread_is_allowed() {
    let all = deviations("0,0,180,100,0,0,0,0\n0.5,9,9,9,9,9,9,9\n1,0,180,107,2,12,0,0");
    let altitude = of(&all, "alt");
    assert_eq!((altitude.error, altitude.spread, altitude.tolerance), (5.0, 2.0, 4.0));
    assert!(!altitude.passes());
    // From the simulator with the finest step: 107 - 103.
    assert_eq!(altitude.tight, Some((4.0, 0.5)));
    // The outlier is drawn, and does not set the tolerance.
    assert_eq!(altitude.simulators[2], ("06".to_owned(), 48.0, false));
    assert_eq!(of(&all, "vn").error, 0.0);
    // The mean of two sides of the date line is on it, 11 m from each.
    let east = of(&all, "pos_e");
    assert!(east.error < 1e-6 && (east.spread - 22.264).abs() < 0.01, "{east:?}");
    // One simulator has no spread: the printed digits are allowed. The yaw of 12 deg is 2 deg from it, that of 0 deg 10 deg.
    let attitude = of(&all, "att");
    assert!((attitude.error - 10.0).abs() < 1e-9, "{attitude:?}");
    assert_eq!((attitude.spread, attitude.tolerance), (0.0, 0.001));
    assert!(all.iter().all(|one| one.quantity.name != "rho"), "nobody has a density");
}

#[test]
fn quaternions_and_angles_are_the_same_attitude() {
    let [w, x, y, z] =
        icd::Attitude::from_euler(icd::EulerAngles { phi: -2.0, theta: 0.5, psi: 3.0 }).wxyz();
    let angles = [3.0_f64, 0.5, -2.0].map(f64::to_degrees);
    let [yaw, pitch, roll] = angles;
    let text = format!("time_s,yaw_deg,pitch_deg,roll_deg\n0,{yaw},{pitch},{roll}");
    let by_angles = Trajectory::read("a", &text).unwrap();
    let text = format!("time_s,qw,qx,qy,qz\n0,{},{},{},{}", -w, -x, -y, -z);
    let by_quaternion = Trajectory::read("b", &text).unwrap();
    let angle = quaternion_angle(&by_angles.attitude[0], &by_quaternion.attitude[0]);
    assert!(angle < 1e-14, "{angle} rad");
}

#[test]
fn data_that_cannot_be_compared_are_refused_with_file_and_line() {
    let message = |text: &str| Trajectory::read("my.csv", text).unwrap_err().to_string();
    assert_eq!(message("t,x\n1,2"), "my.csv: line 1: no column time_s in the header");
    assert_eq!(message("time_s,x\n"), "my.csv: line 2: no rows");
    assert_eq!(message("time_s,x\n1,2\n1"), "my.csv: line 3: 1 values, expected 2");
    assert_eq!(message("time_s,x\n1,nan"), "my.csv: line 2: \"nan\" is no finite number");
    let folder = folder();
    let references = References::open(folder.path()).unwrap();
    let unknown = references.case("8").unwrap_err().to_string();
    assert!(unknown.ends_with("no case 8, there are 7"), "{unknown}");
    let short = Trajectory::read("my.csv", &format!("{HEADER}\n0,0,180,100,0,0,0,0")).unwrap();
    let short = references.case("7").unwrap().deviations(&short).unwrap_err().to_string();
    assert!(short.starts_with("my.csv: no row at 1 s"), "{short}");
    fs::write(folder.path().join("manifest.json"), "[]").unwrap();
    let message = References::open(folder.path()).unwrap_err().to_string();
    assert!(message.contains("manifest.json"), "{message}");
    assert!(References::open(&folder.path().join("none")).is_err());
}
