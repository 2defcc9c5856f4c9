//! A trajectory as a table of columns, as `sitl study checkcase` and the reference data have it.

use std::collections::BTreeMap;

use host_io::problem::{Problem, problem};

/// Times of two trajectories that count as the same, s.
const SAME_TIME_S: f64 = 1.0e-6;

/// A trajectory as columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    name: String,
    /// By name, all of one length.
    pub(super) columns: BTreeMap<String, Vec<f64>>,
    /// Quaternions (w, x, y, z) that turn body axes into NED; empty without attitude.
    pub(super) attitude: Vec<[f64; 4]>,
}

impl Trajectory {
    /// Reads comma-separated values; errors call them `name`.
    pub fn read(name: &str, text: &str) -> Result<Self, Problem> {
        let wrong = |line: usize, what: String| problem!("{name}: line {}: {what}", line + 1);
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let header = lines.next().map_or("", |(_, header)| header);
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        if !names.contains(&"time_s") {
            return Err(wrong(0, "no column time_s in the header".to_owned()));
        }
        let mut columns = vec![Vec::new(); names.len()];
        for (number, line) in lines {
            let cells: Vec<&str> = line.split(',').collect();
            if cells.len() != names.len() {
                let problem = format!("{} values, expected {}", cells.len(), names.len());
                return Err(wrong(number, problem));
            }
            for (column, cell) in columns.iter_mut().zip(cells) {
                let value = cell.trim().parse::<f64>().ok().filter(|value| value.is_finite());
                let Some(value) = value else {
                    return Err(wrong(number, format!("{cell:?} is no finite number")));
                };
                column.push(value);
            }
        }
        if columns[0].is_empty() {
            return Err(wrong(1, "no rows".to_owned()));
        }
        let columns = names.into_iter().map(str::to_owned).zip(columns).collect();
        let mut trajectory = Self { name: name.to_owned(), columns, attitude: Vec::new() };
        trajectory.attitude = trajectory.quaternions();
        Ok(trajectory)
    }

    pub(super) fn times(&self) -> &[f64] {
        &self.columns["time_s"]
    }

    fn quaternions(&self) -> Vec<[f64; 4]> {
        let columns = |names: &[&str]| -> Option<Vec<&Vec<f64>>> {
            names.iter().map(|name| self.columns.get(*name)).collect()
        };
        // Rather than the angles, which lose digits near 90 degrees of pitch.
        if let Some(q) = columns(&["qw", "qx", "qy", "qz"]) {
            return (0..q[0].len())
                .map(|i| normalised([q[0][i], q[1][i], q[2][i], q[3][i]]))
                .collect();
        }
        let Some(e) = columns(&["roll_deg", "pitch_deg", "yaw_deg"]) else { return Vec::new() };
        let quaternion = |i: usize| {
            let [phi, theta, psi] = [e[0][i], e[1][i], e[2][i]].map(f64::to_radians);
            icd::Attitude::from_euler(icd::EulerAngles { phi, theta, psi }).wxyz()
        };
        (0..e[0].len()).map(quaternion).collect()
    }

    /// The rows at these times.
    pub(super) fn at(&self, times: &[f64]) -> Result<Self, Problem> {
        let ours = self.times();
        let row = |time_s: &f64| {
            let near = ours.partition_point(|t| *t < time_s - SAME_TIME_S);
            let is_there = ours.get(near).is_some_and(|t| (t - time_s).abs() <= SAME_TIME_S);
            let missing = || {
                problem!(
                    "{}: no row at {time_s} s, which the reference has; another output_rate_hz may have it",
                    self.name
                )
            };
            is_there.then_some(near).ok_or_else(missing)
        };
        let rows: Vec<usize> = times.iter().map(row).collect::<Result<_, _>>()?;
        let chosen = |column: &Vec<f64>| rows.iter().map(|row| column[*row]).collect();
        let columns = self.columns.iter().map(|(name, column)| (name.clone(), chosen(column)));
        let attitude = match self.attitude.is_empty() {
            true => Vec::new(),
            false => rows.iter().map(|row| self.attitude[*row]).collect(),
        };
        Ok(Self { name: self.name.clone(), columns: columns.collect(), attitude })
    }

    /// The mean of trajectories with the same times, in the columns that all of them have.
    pub(super) fn mean(all: &[&Self]) -> Self {
        let first = all[0];
        let share = 1.0 / all.len() as f64;
        let mean_at = |name: &String, i: usize| {
            // Differences from the first one: longitudes near the date line keep together.
            let base = first.columns[name][i];
            let wrap = |way: f64| match name.as_str() {
                "lon_deg" => (way + 180.0).rem_euclid(360.0) - 180.0,
                _ => way,
            };
            base + share * all.iter().map(|one| wrap(one.columns[name][i] - base)).sum::<f64>()
        };
        let names = first
            .columns
            .keys()
            .filter(|name| all.iter().all(|one| one.columns.contains_key(*name)));
        let count = first.times().len();
        let columns = names
            .map(|name| (name.clone(), (0..count).map(|i| mean_at(name, i)).collect()))
            .collect();
        let attitude = match all.iter().any(|one| one.attitude.is_empty()) {
            true => Vec::new(),
            false => {
                (0..count).map(|i| mean_quaternion(all.iter().map(|one| one.attitude[i]))).collect()
            }
        };
        Self { name: "mean".to_owned(), columns, attitude }
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn normalised(q: [f64; 4]) -> [f64; 4] {
    let length = dot(&q, &q).sqrt();
    q.map(|part| part / length)
}

/// Mean of quaternions that are near each other; q and -q are the same attitude.
fn mean_quaternion(all: impl Iterator<Item = [f64; 4]>) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for q in all {
        let sign = if dot(&sum, &q) < 0.0 { -1.0 } else { 1.0 };
        sum = std::array::from_fn(|i| sum[i] + sign * q[i]);
    }
    normalised(sum)
}

/// Angle of the rotation from one attitude to the other, rad; exact for small ones.
pub(super) fn quaternion_angle(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let [aw, ax, ay, az] = *a;
    let [bw, bx, by, bz] = *b;
    let x = aw * bx - ax * bw - ay * bz + az * by;
    let y = aw * by + ax * bz - ay * bw - az * bx;
    let z = aw * bz - ax * by + ay * bx - az * bw;
    // By the vector part: the arc cosine of the scalar part would lose small angles.
    2.0 * (x * x + y * y + z * z).sqrt().atan2(dot(a, b).abs())
}
