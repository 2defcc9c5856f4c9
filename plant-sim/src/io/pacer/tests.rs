use host_io::clock;

use super::*;

/// A pacer and its two clocks: simulation time moves only when the pacer says that a tick is due.
struct World {
    pacer: Pacer,
    start: Instant,
    wall: Duration,
    time: SimTime,
    ticks: u32,
}

impl World {
    fn new(speed: Speed, paused: bool) -> Self {
        let pacer = Pacer::new(ControlPeriod::DEFAULT, speed, paused);
        let start = clock::now();
        Self { pacer, start, wall: Duration::ZERO, time: SimTime::ZERO, ticks: 0 }
    }

    fn due(&mut self) -> Due {
        let (time, now) = (self.time, self.start + self.wall);
        self.pacer.due(time, time + ControlPeriod::DEFAULT, || now)
    }

    /// Lets wall time pass, and flies the ticks that are due.
    fn pass_ms(&mut self, ms: u64) {
        let end = self.wall + Duration::from_millis(ms);
        loop {
            match self.due() {
                Due::Now => {
                    self.time = self.time + ControlPeriod::DEFAULT;
                    self.ticks += 1;
                    self.pacer.advanced(self.time);
                }
                Due::In(left) if self.wall + left <= end => self.wall += left,
                Due::In(_) | Due::Never => break,
            }
        }
        self.wall = end;
    }

    fn request(&mut self, request: u32, pace: Pace) {
        self.pacer.request(PaceRequest { request: Some(request), pace }, self.time);
    }

    fn reports(&mut self) -> Vec<(Option<u32>, Pace, SimTime)> {
        std::iter::from_fn(|| self.pacer.pop_report())
            .map(|report| match report {
                PlantReport::Paced { request, pace, at } => (request, pace, at),
                other => panic!("{other:?}"),
            })
            .collect()
    }
}

fn ms(ms: u64) -> SimTime {
    SimTime::from_micros(1_000 * ms)
}

#[test]
fn time_stands_still_during_a_pause_and_is_not_made_up_afterwards() {
    let mut world = World::new(Speed::REAL_TIME, false);
    world.pass_ms(100);
    assert_eq!(world.time, ms(100));
    world.request(1, Pace::Pause);
    assert_eq!(world.due(), Due::Never);
    world.pass_ms(60_000);
    assert_eq!(world.time, ms(100));
    world.request(2, Pace::Run);
    world.pass_ms(10);
    assert_eq!(world.time, ms(110));
    let expected = [(Some(1), Pace::Pause, ms(100)), (Some(2), Pace::Run, ms(100))];
    assert_eq!(world.reports(), expected);
}

#[test]
fn steps_are_exact_and_confirmed_when_they_are_done() {
    let mut world = World::new(Speed::REAL_TIME, true);
    world.pass_ms(1_000);
    assert_eq!(world.ticks, 0);
    world.request(7, Pace::Step(3));
    world.pass_ms(5);
    assert_eq!((world.ticks, world.reports()), (2, vec![]));
    world.pass_ms(1_000);
    assert_eq!(world.ticks, 3);
    assert_eq!(world.reports(), [(Some(7), Pace::Step(3), ms(6))]);
    assert_eq!(world.due(), Due::Never);
}

#[test]
fn steps_out_of_a_running_flight_end_in_a_pause() {
    let mut world = World::new(Speed::Times(10.0), false);
    world.pass_ms(100);
    let before = world.ticks;
    world.request(7, Pace::Step(5));
    world.pass_ms(100);
    assert_eq!(world.ticks, before + 5);
}

#[test]
fn steps_requested_faster_than_they_are_flown_are_all_flown() {
    let mut world = World::new(Speed::Times(0.01), true);
    for request in 0..3 {
        world.request(request, Pace::Step(1));
    }
    world.pass_ms(600);
    assert_eq!(world.ticks, 3);
    let expected: Vec<_> =
        (0..3).map(|n| (Some(n), Pace::Step(1), ms(2 * u64::from(n) + 2))).collect();
    assert_eq!(world.reports(), expected);
}

#[test]
fn long_steps_are_confirmed_at_once_and_their_end_is_reported() {
    let mut world = World::new(Speed::REAL_TIME, true);
    world.request(7, Pace::Step(1_000));
    assert_eq!(world.reports(), [(Some(7), Pace::Step(1_000), ms(0))]);
    world.pass_ms(3_000);
    assert_eq!(world.ticks, 1_000);
    assert_eq!(world.reports(), [(None, Pace::Pause, ms(2_000))]);
}

#[test]
fn interrupted_steps_are_answered_with_the_pace_that_replaced_them() {
    for pace in [Pace::Pause, Pace::Run] {
        let mut world = World::new(Speed::REAL_TIME, true);
        world.request(1, Pace::Step(100));
        world.request(2, Pace::Step(100));
        world.pass_ms(20);
        world.request(3, pace);
        let expected: Vec<_> = (1..=3).map(|n| (Some(n), pace, ms(20))).collect();
        assert_eq!(world.reports(), expected);
        world.pass_ms(1_000);
        assert_eq!(world.ticks, if pace == Pace::Run { 510 } else { 10 });
    }
}

#[test]
fn a_speed_requested_during_a_pause_is_that_of_the_run_after_it() {
    let mut world = World::new(Speed::Max, true);
    world.request(1, Pace::Speed(0.5));
    world.pass_ms(1_000);
    assert_eq!(world.ticks, 0);
    assert_eq!(world.reports(), [(Some(1), Pace::Speed(0.5), ms(0))]);
    world.request(2, Pace::Run);
    world.pass_ms(1_000);
    assert_eq!(world.time, ms(500));
}

#[test]
fn a_change_of_speed_counts_from_the_moment_of_the_change() {
    let mut world = World::new(Speed::REAL_TIME, false);
    world.pass_ms(1_000);
    world.request(1, Pace::Speed(0.1));
    world.pass_ms(1_000);
    assert_eq!(world.time, ms(1_100));
    world.request(2, Pace::Speed(20.0));
    world.pass_ms(100);
    assert_eq!(world.time, ms(3_100));
}

#[test]
fn a_small_delay_is_caught_up_and_a_long_one_is_not() {
    let mut world = World::new(Speed::REAL_TIME, false);
    world.pass_ms(8);
    assert_eq!(world.due(), Due::In(Duration::from_millis(2)));
    // 100 ms late: the ticks in between are due at once.
    world.wall += Duration::from_millis(100);
    world.pass_ms(0);
    assert_eq!(world.time, ms(108));
    // 1 s late: simulation time continues from here.
    world.wall += Duration::from_millis(1_000);
    world.pass_ms(0);
    assert_eq!(world.time, ms(110));
    assert_eq!(world.due(), Due::In(Duration::from_millis(2)));
}

#[test]
fn as_fast_as_possible_reads_no_clock() {
    let mut pacer = Pacer::new(ControlPeriod::DEFAULT, Speed::Max, false);
    assert_eq!(pacer.due(ms(0), ms(2), || panic!("the clock was read")), Due::Now);
}

#[test]
fn a_new_flight_keeps_the_pace_and_forgets_the_steps() {
    let mut world = World::new(Speed::REAL_TIME, false);
    world.request(1, Pace::Speed(2.0));
    world.request(2, Pace::Step(100));
    world.pacer.begin_flight();
    world.time = SimTime::ZERO;
    assert_eq!(world.reports(), []);
    assert_eq!(world.pacer.take_change(), Some((true, Speed::Times(2.0))));
    assert_eq!(world.pacer.take_change(), None);
    assert_eq!(world.due(), Due::Never);
}

#[test]
fn a_flood_of_requests_is_answered_and_stays_bounded() {
    let mut world = World::new(Speed::Times(0.01), true);
    let mut answered = 0;
    for request in 0..1_000 {
        world.request(request, Pace::Step(1));
        assert!(world.pacer.steps.len() <= STEPS_WAITING_MAX);
        answered += world.reports().len();
    }
    // Five steps fit into the second in which an answer may be waited for; the others had theirs at once.
    assert_eq!(answered, 1_000 - 5);
    assert!(!world.pacer.has_room());
    world.request(1_000, Pace::Run);
    assert_eq!(world.reports().len(), 5 + 1);
    assert!(world.pacer.has_room());
}
