//! What a linear loop can stand: eigenvalues, and margins of gain, phase and delay at a group of effectors.

use std::f64::consts::PI;

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, ComplexField, DMatrix, Schur};

/// Lowest frequency that is looked at, rad/s.
const LOWEST_RAD_S: f64 = 1.0e-3;
/// Frequencies between the lowest one and half the sampling frequency, in equal ratios.
const FREQUENCIES: u32 = 500;
/// Halvings of an interval with a crossing.
const HALVINGS: u32 = 40;
/// Beyond this gain a crossing is noise of the differences.
const GAIN_MAX: f64 = 1.0e4;
/// Of the QR algorithm that finds the eigenvalues.
const QR_TOLERANCE: f64 = 1.0e-12;
const QR_ITERATIONS: usize = 100_000;
/// What is gone after one period: z = 0 but for rounding.
const DEAD_BEAT: f64 = 1.0e-6;
/// 2^40 periods.
const SQUARINGS: u32 = 40;
/// A spectral radius up to here counts as stable: slow integrators are near 1, and the differences have noise.
const STABLE: f64 = 1.0 + 1.0e-7;

/// x' = A x + B u with A for commands that stay, and C x, the change of the commands that the laws command.
#[derive(Debug, Clone)]
pub struct Linear {
    /// States in which everything that the laws command is ignored by the plant.
    pub a: DMatrix<f64>,
    /// From the commands of the effectors, rad or N.
    pub b: DMatrix<f64>,
    pub c: DMatrix<f64>,
}

/// What a loop can stand before it becomes unstable, one thing at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// The highest frequency at which the loop's gain is one, rad/s; none if there is none.
    pub crossover_rad_s: Option<f64>,
    /// Factors on the commands between which the loop is stable: 0 and infinity where there is no limit.
    pub gain: [f64; 2],
    /// Additional lag at a crossover, rad; none without a crossover.
    pub phase_rad: Option<f64>,
    /// Additional delay of the commands, s; none without a crossover.
    pub delay_s: Option<f64>,
}

impl Linear {
    /// A of the loop that is closed at every effector, those in `group` with a factor on their commands.
    fn closed(&self, group: &[usize], factor: f64) -> DMatrix<f64> {
        let mut c = self.c.clone();
        for i in group {
            c.row_mut(*i).scale_mut(factor);
        }
        &self.a + &self.b * c
    }

    /// Whether a command of the group depends on anything.
    pub fn commands_any(&self, group: &[usize]) -> bool {
        let commanded = &self.c * &self.a;
        let through = &self.c * &self.b;
        group.iter().any(|i| commanded.row(*i).amax() > 0.0 || through.row(*i).amax() > 0.0)
    }

    /// Eigenvalues of the closed loop, 1/s, slowest first: s = ln(z)/h, without those of a value that is
    /// only remembered for one period. `None` if the QR algorithm does not converge.
    pub fn eigenvalues(&self, period_s: f64) -> Option<Vec<Complex<f64>>> {
        // Moved by one: several eigenvalues are zero, and there the algorithm finds no scale to converge to.
        let mut moved = self.closed(&[], 1.0);
        for i in 0..moved.nrows() {
            moved[(i, i)] += 1.0;
        }
        balance_parlett_reinsch(&mut moved);
        let z = Schur::try_new(moved, QR_TOLERANCE, QR_ITERATIONS)?.complex_eigenvalues();
        let one = Complex::new(1.0, 0.0);
        let z = z.iter().map(|z| z - one).filter(|z| z.modulus() > DEAD_BEAT);
        let mut s: Vec<_> = z.map(|z| z.ln() / Complex::new(period_s, 0.0)).collect();
        s.sort_by(|a, b| a.modulus().total_cmp(&b.modulus()).then(b.im.total_cmp(&a.im)));
        Some(s)
    }

    /// How fast the slowest or most unstable motion decays (negative) or grows with a factor on a group's commands, 1/s.
    pub fn growth(&self, group: &[usize], factor: f64, period_s: f64) -> f64 {
        libm::log(spectral_radius(self.closed(group, factor))) / period_s
    }

    /// Whether the loop is stable with a factor on the commands of a group.
    pub fn is_stable(&self, group: &[usize], factor: f64) -> bool {
        spectral_radius(self.closed(group, factor)) <= STABLE
    }

    /// Margins of the loop that is opened at the commands of a group and closed at all others.
    pub fn margins(&self, group: &[usize], period_s: f64) -> Margins {
        let open = self.closed(group, 0.0);
        let b = self.b.select_columns(group).map(|x| Complex::new(x, 0.0));
        let c = self.c.select_rows(group).map(|x| Complex::new(x, 0.0));
        let locus = |w: f64| characteristic(&open, &b, &c, on_the_unit_circle(w * period_s));
        let highest = PI / period_s;
        let frequency = |i: u32| {
            LOWEST_RAD_S * (highest / LOWEST_RAD_S).powf(f64::from(i) / f64::from(FREQUENCIES))
        };
        let (mut gain, mut crossovers) = ([0.0_f64, f64::INFINITY], Vec::new());
        // At its two ends, z = 1 and z = -1, the locus is real.
        for end in [0.0, highest] {
            let at = locus(end);
            if at.re < 0.0 && at.re.is_finite() {
                self.narrow(&mut gain, group, -1.0 / at.re);
            }
        }
        let mut before = (LOWEST_RAD_S, locus(LOWEST_RAD_S));
        for i in 1..FREQUENCIES {
            let here = (frequency(i), locus(frequency(i)));
            // Only a crossing of the negative real axis can limit the gain.
            if before.1.im * here.1.im < 0.0 && before.1.re.min(here.1.re) < 0.0 {
                let at = locus(crossing(before.0, here.0, |w| locus(w).im));
                if at.re < 0.0 {
                    self.narrow(&mut gain, group, -1.0 / at.re);
                }
            }
            if (before.1.modulus() - 1.0) * (here.1.modulus() - 1.0) < 0.0 {
                crossovers.push(crossing(before.0, here.0, |w| locus(w).modulus() - 1.0));
            }
            before = here;
        }
        // From the locus to -1: backwards in phase, 0 to 360 deg.
        let lag = |w: &f64| locus(*w).argument() + PI;
        let either_way = |w: &f64| lag(w).min(2.0 * PI - lag(w));
        Margins {
            crossover_rad_s: crossovers.iter().copied().reduce(f64::max),
            gain,
            phase_rad: crossovers.iter().map(either_way).reduce(f64::min),
            delay_s: crossovers.iter().map(|w| lag(w) / w).reduce(f64::min),
        }
    }

    /// Takes a factor at which an eigenvalue is on the unit circle as a limit, if the loop is unstable beyond it.
    fn narrow(&self, gain: &mut [f64; 2], group: &[usize], factor: f64) {
        // A little beyond, because on the limit itself rounding decides.
        let (side, beyond) = if factor > 1.0 { (1, 1.01) } else { (0, 0.99) };
        let is_nearer = if side == 1 { factor < gain[1].min(GAIN_MAX) } else { factor > gain[0] };
        if is_nearer && !self.is_stable(group, factor * beyond) {
            gain[side] = factor;
        }
    }
}

/// Largest magnitude of an eigenvalue: the limit of ‖Aⁿ‖^(1/n), by squaring.
fn spectral_radius(mut a: DMatrix<f64>) -> f64 {
    let (mut log, mut share) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let size = a.norm();
        if size == 0.0 {
            return 0.0;
        }
        // In logarithms, because a power of 2^40 periods would overflow.
        log += share * libm::log(size);
        share *= 0.5;
        a /= size;
        a = &a * &a;
    }
    libm::exp(log)
}

/// The largest eigenvalue of L(z) = -C (z I - A)⁻¹ B; the loop is unstable where one of them goes around -1.
fn characteristic(
    a: &DMatrix<f64>,
    b: &DMatrix<Complex<f64>>,
    c: &DMatrix<Complex<f64>>,
    z: Complex<f64>,
) -> Complex<f64> {
    let mut pencil = a.map(|x| Complex::new(-x, 0.0));
    for i in 0..a.nrows() {
        pencil[(i, i)] += z;
    }
    // Here z is a pole of the open loop.
    let Some(x) = pencil.lu().solve(b) else { return Complex::new(f64::INFINITY, 0.0) };
    let l = -(c * x);
    if l.nrows() == 1 {
        return l[(0, 0)];
    }
    let largest = |a: Complex<f64>, b: Complex<f64>| if b.modulus() > a.modulus() { b } else { a };
    // Effectors that always move together have one eigenvalue that is not zero.
    l.clone()
        .eigenvalues()
        .map_or_else(|| l.trace(), |all| all.iter().copied().fold(Complex::new(0.0, 0.0), largest))
}

fn on_the_unit_circle(angle_rad: f64) -> Complex<f64> {
    let (sin, cos) = libm::sincos(angle_rad);
    Complex::new(cos, sin)
}

/// Where `f` changes its sign between two frequencies.
fn crossing(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high, sign) = (low, high, f(low).signum());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == sign { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One integrator with a delay of one period and a gain of `k` per second: z/(z-1) held, L = k h / (z - 1).
    fn integrator(k: f64, h: f64) -> Linear {
        Linear {
            a: DMatrix::from_element(1, 1, 1.0),
            b: DMatrix::from_element(1, 1, h),
            c: DMatrix::from_element(1, 1, -k),
        }
    }

    #[test]
    fn a_sampled_integrator_has_its_known_margins() {
        let (k, h) = (2.0, 0.01);
        let margins = integrator(k, h).margins(&[0], h);
        // abs(z - 1) = 2 sin(w h / 2) = k h.
        let w = 2.0 / h * (k * h / 2.0).asin();
        assert!((margins.crossover_rad_s.unwrap() - w).abs() < 1.0e-6);
        // The phase of 1/(z - 1) is -90 deg - w h / 2.
        assert!((margins.phase_rad.unwrap() - (PI / 2.0 - w * h / 2.0)).abs() < 1.0e-6);
        assert!((margins.delay_s.unwrap() - (PI / 2.0 - w * h / 2.0) / w).abs() < 1.0e-6);
        // At z = -1 the gain is k h / 2.
        assert_eq!(margins.gain[0], 0.0);
        assert!((margins.gain[1] - 2.0 / (k * h)).abs() < 1.0e-6);
    }

    #[test]
    fn the_gain_margin_is_where_an_eigenvalue_reaches_the_unit_circle() {
        // Two integrators and a lag: a double integrator with damping by the second state.
        let h = 0.01;
        let linear = Linear {
            a: DMatrix::from_row_slice(3, 3, &[1.0, h, 0.0, 0.0, 1.0, h, 0.0, 0.0, 0.8]),
            b: DMatrix::from_column_slice(3, 1, &[0.0, 0.0, 0.2]),
            c: DMatrix::from_row_slice(1, 3, &[-4.0, -3.0, 0.0]),
        };
        let margins = linear.margins(&[0], h);
        let [_, most] = margins.gain;
        assert!(most > 2.0 && most < 100.0, "{margins:?}");
        assert!(linear.is_stable(&[0], 0.999 * most) && !linear.is_stable(&[0], 1.001 * most));
    }

    #[test]
    fn a_loop_that_is_unstable_without_feedback_has_a_lower_limit_too() {
        let h = 0.01;
        let linear = Linear {
            a: DMatrix::from_row_slice(2, 2, &[1.02, h, 0.0, 0.5]),
            b: DMatrix::from_column_slice(2, 1, &[0.0, 0.5]),
            c: DMatrix::from_row_slice(1, 2, &[-10.0, 0.0]),
        };
        assert!(linear.is_stable(&[0], 1.0) && !linear.is_stable(&[0], 0.0));
        let [least, _] = linear.margins(&[0], h).gain;
        // At z = 1 the characteristic equation gives 0.02 = 10 k h.
        assert!((least - 0.2).abs() < 2.0e-3, "{least}");
    }
}
