//! The channels of an MCAP file: what each has messages of, and when.

use std::collections::BTreeMap;

use host_io::problem::{Problem, problem};
use icd::record::effector_field;
use lab_engine::geometry::{AircraftGeometry, GeometryPart};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use ulog::format::{Field, FieldType};
use ulog::reader::Topic;

use super::foxglove::{
    self, Color, FrameTransform, FrameTransforms, Level, LinePrimitive, LocationFix, LogMessage,
    Point, Pose, PoseInFrame, SceneEntity, SceneUpdate, Timestamp,
};
use super::protobuf::{self, FieldValue as _, Message};
use super::scene::{self, BODY, WORLD};
use crate::plot::flight::{Flight, Kind, LogEvent};

/// Most points of the line along the track.
const TRACK_POINTS_MAX: usize = 2_000;
/// Width of that line, pixels.
const TRACK_WIDTH: f64 = 2.0;

const FIXED: Color = Color { r: 0.75, g: 0.79, b: 0.85, a: 1.0 };
const TURNING: Color = Color { r: 0.34, g: 0.71, b: 0.91, a: 1.0 };
const FAILED: Color = Color { r: 0.84, g: 0.15, b: 0.16, a: 1.0 };
const TRACK: Color = Color { r: 0.9, g: 0.62, b: 0.0, a: 1.0 };

/// Messages of one type under one name.
pub struct Channel<'a> {
    pub topic: String,
    pub schema_name: String,
    pub schema: Vec<u8>,
    /// Times, us, and numbers for `message`.
    pub rows: Vec<(u64, usize)>,
    /// The bytes of the message with this time and number.
    pub message: Box<dyn Fn(u64, usize) -> Vec<u8> + 'a>,
}

/// All channels of a flight.
pub fn channels<'a>(
    flight: &'a Flight,
    geometry: &'a AircraftGeometry,
) -> Result<Vec<Channel<'a>>, Problem> {
    let truth = flight.log.topic("truth").filter(|truth| !truth.is_empty());
    let truth = truth.ok_or_else(|| {
        problem!("it has no truth, from which the aircraft and its surfaces are shown")
    })?;
    let poses = true_poses(flight);
    if poses.is_empty() {
        return Err(problem!("its truth has no row with a position and an attitude"));
    }
    let first = poses[0].0;
    let mut channels = vec![
        scene(flight, geometry, &poses),
        transforms(flight, geometry, &truth, poses),
        location(flight),
        estimate(flight),
        events(flight),
    ];
    channels.extend(geometry.parts.iter().map(|part| points(part, first)));
    channels.extend(flight.log.topics().filter_map(|topic| signals(flight, topic)));
    channels.retain(|channel| !channel.rows.is_empty());
    Ok(channels)
}

impl<'a> Channel<'a> {
    /// Messages in the order of time.
    fn of<T: 'a, M: Message>(
        topic: &str,
        timed: Vec<(u64, T)>,
        message: impl Fn(Timestamp, &T) -> M + 'a,
    ) -> Self {
        Self {
            topic: topic.to_owned(),
            schema_name: M::TYPE_NAME.to_owned(),
            schema: foxglove::schema(),
            rows: timed.iter().enumerate().map(|(row, (us, _))| (*us, row)).collect(),
            message: Box::new(move |us, row| {
                message(Timestamp::from_us(us), &timed[row].1).encoded()
            }),
        }
    }
}

fn to_us(t_s: f64) -> u64 {
    // A time before zero is none of a flight; the cast makes it zero.
    (t_s * 1.0e6).round() as u64
}

/// Number of each row of the truth, with the pose of frame `body` in frame `world`; a row without one is left out.
fn true_poses(flight: &Flight) -> Vec<(u64, (usize, Isometry3<f64>))> {
    let columns =
        ["position_north_m", "position_east_m", "position_down_m", "q_w", "q_x", "q_y", "q_z"];
    let rows = flight.rows("truth", columns).into_iter().enumerate();
    let rows = rows.filter(|(_, (_, values))| values.iter().all(|value| value.is_finite()));
    rows.map(|(row, (us, [north, east, down, w, x, y, z]))| {
        let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        (us, (row, scene::body_in_world(&Vector3::new(north, east, down), &q)))
    })
    .collect()
}

/// `/tf`: the body in the world, and each part that turns in the body, by the true positions of its effectors.
fn transforms<'a>(
    flight: &'a Flight,
    geometry: &'a AircraftGeometry,
    truth: &Topic<'_>,
    poses: Vec<(u64, (usize, Isometry3<f64>))>,
) -> Channel<'a> {
    let list = &flight.effectors;
    let angles: BTreeMap<&str, Vec<f64>> = list
        .all()
        .filter_map(|effector| {
            let column = flight.column(truth, &effector_field("position", list, effector))?;
            Some((list.name(effector), column))
        })
        .collect();
    Channel::of("/tf", poses, move |timestamp, (row, body)| {
        let transform = |parent: &str, child: &str, pose: &Isometry3<f64>| {
            let Pose { position, orientation } = pose.into();
            FrameTransform {
                timestamp: timestamp.clone(),
                parent_frame_id: parent.to_owned(),
                child_frame_id: child.to_owned(),
                translation: position,
                rotation: orientation,
            }
        };
        // A number that is none has no angle.
        let angle =
            |name: &str| angles.get(name).map(|all| all[*row]).filter(|rad| rad.is_finite());
        let parts = geometry.parts.iter().filter_map(|part| {
            let pose = scene::part_in_body(part, |name| angle(name).unwrap_or(0.0))?;
            Some(transform(BODY, &scene::frame_of(part), &pose))
        });
        let body = transform(WORLD, BODY, body);
        FrameTransforms { transforms: std::iter::once(body).chain(parts).collect() }
    })
}

/// `/scene`: all parts and the track once, and again each part that fails or is as before.
fn scene<'a>(
    flight: &'a Flight,
    geometry: &'a AircraftGeometry,
    poses: &[(u64, (usize, Isometry3<f64>))],
) -> Channel<'a> {
    let first = poses[0].0;
    let spans: Vec<_> = flight
        .faults
        .iter()
        .map(|fault| {
            // A fault that lasts acts at the end, too.
            let end = if fault.lasts { u64::MAX } else { to_us(fault.span.1) };
            (flight.effectors.name(fault.effector), to_us(fault.span.0)..end)
        })
        .collect();
    let mut times: Vec<u64> = spans.iter().flat_map(|(_, span)| [span.start, span.end]).collect();
    times.retain(|us| *us > first && *us != u64::MAX);
    times.push(first);
    times.sort_unstable();
    times.dedup();
    let has_failed = move |part: &GeometryPart, us: u64| {
        let acts = |name| spans.iter().any(|(failed, span)| *failed == name && span.contains(&us));
        part.effectors().any(acts)
    };
    let every = poses.len().div_ceil(TRACK_POINTS_MAX);
    let places = poses.iter().step_by(every).chain(poses.last());
    let track: Vec<Point> =
        places.map(|(_, (_, pose))| Point::from(&pose.translation.vector)).collect();
    let timed = times.into_iter().map(|us| (us, us)).collect();
    Channel::of("/scene", timed, move |timestamp, us| {
        let is_new = |part: &&GeometryPart| {
            *us == first || has_failed(part, *us) != has_failed(part, us - 1)
        };
        let entity = |part: &GeometryPart| {
            let color = match (has_failed(part, *us), part.hinges.first()) {
                (true, _) => FAILED,
                (false, Some(_)) => TURNING,
                (false, None) => FIXED,
            };
            scene::entity(part, color, timestamp.clone())
        };
        let track = (*us == first).then(|| track_entity(&track, timestamp.clone()));
        SceneUpdate {
            entities: geometry.parts.iter().filter(is_new).map(entity).chain(track).collect(),
        }
    })
}

fn track_entity(points: &[Point], timestamp: Timestamp) -> SceneEntity {
    let line = LinePrimitive {
        pose: Pose::from(&Isometry3::identity()),
        thickness: TRACK_WIDTH,
        scale_invariant: true,
        points: points.to_vec(),
        color: TRACK,
    };
    SceneEntity {
        timestamp,
        frame_id: WORLD.to_owned(),
        id: "track".to_owned(),
        lines: vec![line],
        ..SceneEntity::default()
    }
}

/// `/points/...`: a part as a cloud of points, for viewers that know no `foxglove.SceneUpdate`, as Rerun.
fn points(part: &GeometryPart, first: u64) -> Channel<'_> {
    let topic = format!("/points/{}", part.name);
    Channel::of(&topic, vec![(first, ())], |timestamp, ()| scene::cloud(part, timestamp))
}

/// `/location`: where the aircraft truly is, for maps.
fn location<'a>(flight: &Flight) -> Channel<'a> {
    let rows = flight.rows("truth", ["latitude_rad", "longitude_rad", "altitude_m"]);
    Channel::of("/location", rows, |timestamp, [latitude, longitude, altitude_m]| LocationFix {
        latitude: latitude.to_degrees(),
        longitude: longitude.to_degrees(),
        altitude: *altitude_m,
        timestamp,
        frame_id: BODY.to_owned(),
    })
}

/// `/estimate`: the pose that the control laws use, where it is valid.
fn estimate<'a>(flight: &Flight) -> Channel<'a> {
    let columns = [
        "position_north_m",
        "position_east_m",
        "position_down_m",
        "roll_rad",
        "pitch_rad",
        "yaw_rad",
        "position_valid",
        "attitude_valid",
    ];
    let rows = flight.rows("control", columns).into_iter();
    let poses =
        rows.filter_map(|(us, [north, east, down, roll, pitch, yaw, position, attitude])| {
            let q = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let pose = scene::body_in_world(&Vector3::new(north, east, down), &q);
            (position * attitude > 0.0).then_some((us, pose))
        });
    Channel::of("/estimate", poses.collect(), |timestamp, pose| PoseInFrame {
        timestamp,
        frame_id: WORLD.to_owned(),
        pose: pose.into(),
    })
}

/// `/events`: what happened, in words.
fn events(flight: &Flight) -> Channel<'_> {
    let timed = flight.events.iter().map(|event| (to_us(event.t_s), event)).collect();
    Channel::of("/events", timed, |timestamp, LogEvent { kind, text, .. }| LogMessage {
        timestamp,
        level: match kind {
            Kind::Loss => Level::ERROR,
            Kind::Fault | Kind::Refusal | Kind::Saturation => Level::WARNING,
            Kind::Input | Kind::Script | Kind::Compensator | Kind::Mode | Kind::Flight => {
                Level::INFO
            }
        },
        message: text.clone(),
        name: kind.name().to_owned(),
    })
}

/// The rows of a topic of numbers, under its name.
fn signals<'a>(flight: &Flight, topic: Topic<'a>) -> Option<Channel<'a>> {
    let is_signal =
        |field: &&Field| field.name != "timestamp" && !field.name.starts_with("_padding");
    let fields: Vec<&Field> = topic.fields().iter().filter(is_signal).collect();
    // The others are texts in pieces.
    if topic.multi_id() != 0 || fields.iter().any(|field| field.array.is_some()) {
        return None;
    }
    let described: Vec<_> = fields.iter().zip(1..).map(|(field, n)| described(field, n)).collect();
    let message = protobuf::message(topic.name(), &described);
    Some(Channel {
        topic: format!("/{}", topic.name()),
        schema_name: format!("two_step.{}", topic.name()),
        schema: protobuf::file("two_step", &[], &[message]),
        rows: flight.numbered(&topic),
        message: Box::new(move |_, row| {
            let mut bytes = Vec::new();
            let Some(row) = topic.row(row) else { return bytes };
            for (field, number) in fields.iter().zip(1..) {
                match row.unsigned(&field.name) {
                    Some(whole) => whole.put(number, &mut bytes),
                    None => row.value(&field.name).unwrap_or(f64::NAN).put(number, &mut bytes),
                }
            }
            bytes
        }),
    })
}

/// A column in a descriptor; whole numbers stay whole.
fn described(field: &Field, number: u64) -> Vec<u8> {
    use FieldType::{Bool, U8, U16, U32, U64};
    let describe = match field.kind {
        Bool => protobuf::field::<bool>,
        U8 | U16 | U32 | U64 => protobuf::field::<u64>,
        _ => protobuf::field::<f64>,
    };
    describe(&field.name, number)
}
