//! Messages of Foxglove in an MCAP file: names, numbers and types of <https://docs.foxglove.dev/docs/sdk/schemas>. Of those with
//! many fields they have the fields that are used; readers give the others their default value.

use nalgebra::{Isometry3, Vector3};

use super::protobuf::{EnumDescriptorProto, EnumValueDescriptorProto, FieldValue, TYPE_ENUM};
use super::protobuf::{FileDescriptorProto, messages};

messages! {
    Timestamp = "google.protobuf.Timestamp" {
        seconds: i64 = 1,
        nanos: i32 = 2,
    }

    Vector = "foxglove.Vector3" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    Point = "foxglove.Point3" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    Quaternion = "foxglove.Quaternion" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
        w: f64 = 4,
    }

    Color = "foxglove.Color" {
        r: f64 = 1,
        g: f64 = 2,
        b: f64 = 3,
        a: f64 = 4,
    }

    Pose = "foxglove.Pose" {
        position: Vector = 1,
        orientation: Quaternion = 2,
    }

    FrameTransform = "foxglove.FrameTransform" {
        timestamp: Timestamp = 1,
        parent_frame_id: String = 2,
        child_frame_id: String = 3,
        translation: Vector = 4,
        rotation: Quaternion = 5,
    }

    FrameTransforms = "foxglove.FrameTransforms" {
        transforms: Vec<FrameTransform> = 1,
    }

    PoseInFrame = "foxglove.PoseInFrame" {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        pose: Pose = 3,
    }

    /// Latitude and longitude in degrees, altitude above the ellipsoid in metres.
    LocationFix = "foxglove.LocationFix" {
        latitude: f64 = 1,
        longitude: f64 = 2,
        altitude: f64 = 3,
        timestamp: Timestamp = 6,
        frame_id: String = 7,
    }

    LogMessage = "foxglove.Log" {
        timestamp: Timestamp = 1,
        level: Level = 2,
        message: String = 3,
        name: String = 4,
    } + Level

    /// A strip of lines through the points.
    LinePrimitive = "foxglove.LinePrimitive" {
        pose: Pose = 2,
        thickness: f64 = 3,
        scale_invariant: bool = 4,
        points: Vec<Point> = 5,
        color: Color = 6,
    }

    /// Three points a triangle.
    TriangleListPrimitive = "foxglove.TriangleListPrimitive" {
        pose: Pose = 1,
        points: Vec<Point> = 2,
        color: Color = 3,
    }

    SceneEntity = "foxglove.SceneEntity" {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        id: String = 3,
        frame_locked: bool = 5,
        lines: Vec<LinePrimitive> = 11,
        triangles: Vec<TriangleListPrimitive> = 12,
    }

    SceneUpdate = "foxglove.SceneUpdate" {
        entities: Vec<SceneEntity> = 2,
    }
}

/// `foxglove.Log.Level`, of which events have some.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Level {
    #[default]
    Unknown = 0,
    Info = 2,
    Warning = 3,
    Error = 4,
}

impl Level {
    /// All, in the order of their numbers.
    const NAMES: [&str; 6] = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];

    fn descriptor() -> EnumDescriptorProto {
        let value = |(name, number): (&&str, u64)| EnumValueDescriptorProto {
            name: (*name).to_owned(),
            number,
        };
        let value = Self::NAMES.iter().zip(0..).map(value).collect();
        EnumDescriptorProto { name: "Level".to_owned(), value }
    }
}

impl FieldValue for Level {
    const TYPE: u64 = TYPE_ENUM;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        (*self as u64).put(number, bytes);
    }

    fn describe(_: &mut Vec<FileDescriptorProto>) -> String {
        ".foxglove.Log.Level".to_owned()
    }
}

impl Timestamp {
    /// From microseconds.
    pub fn from_us(us: u64) -> Self {
        // Both fit: a u64 of microseconds has fewer seconds than an i64.
        Self { seconds: (us / 1_000_000) as i64, nanos: (us % 1_000_000) as i32 * 1_000 }
    }
}

impl From<&Vector3<f64>> for Point {
    fn from(place: &Vector3<f64>) -> Self {
        Self { x: place.x, y: place.y, z: place.z }
    }
}

impl From<&Isometry3<f64>> for Pose {
    fn from(pose: &Isometry3<f64>) -> Self {
        let (at, q) = (&pose.translation.vector, pose.rotation.quaternion());
        Self {
            position: Vector { x: at.x, y: at.y, z: at.z },
            orientation: Quaternion { x: q.i, y: q.j, z: q.k, w: q.w },
        }
    }
}
