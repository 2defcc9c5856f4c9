//! Messages of Foxglove in an MCAP file: names, numbers and types of <https://docs.foxglove.dev/docs/sdk/schemas>. Of those with
//! many fields they have the fields that are used; readers give the others their default value.

use nalgebra::{Isometry3, Vector3};

use super::protobuf::{
    FieldValue, Message, enumeration, field, file, message, messages, put_bytes,
};

messages! { times of "google.protobuf":
    Timestamp = "Timestamp" {
        seconds: i64 = 1,
        nanos: i32 = 2,
    }
}

messages! { all of "foxglove":
    Vector = "Vector3" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    Point = "Point3" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
    }

    Quaternion = "Quaternion" {
        x: f64 = 1,
        y: f64 = 2,
        z: f64 = 3,
        w: f64 = 4,
    }

    Color = "Color" {
        r: f64 = 1,
        g: f64 = 2,
        b: f64 = 3,
        a: f64 = 4,
    }

    Pose = "Pose" {
        position: Vector = 1,
        orientation: Quaternion = 2,
    }

    FrameTransform = "FrameTransform" {
        timestamp: Timestamp = 1,
        parent_frame_id: String = 2,
        child_frame_id: String = 3,
        translation: Vector = 4,
        rotation: Quaternion = 5,
    }

    FrameTransforms = "FrameTransforms" {
        transforms: Vec<FrameTransform> = 1,
    }

    PoseInFrame = "PoseInFrame" {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        pose: Pose = 3,
    }

    /// Latitude and longitude in degrees, altitude above the ellipsoid in metres.
    LocationFix = "LocationFix" {
        latitude: f64 = 1,
        longitude: f64 = 2,
        altitude: f64 = 3,
        timestamp: Timestamp = 6,
        frame_id: String = 7,
    }

    LogMessage = "Log" {
        timestamp: Timestamp = 1,
        level: Level = 2,
        message: String = 3,
        name: String = 4,
    } + Level

    /// A strip of lines through the points.
    LinePrimitive = "LinePrimitive" {
        pose: Pose = 2,
        thickness: f64 = 3,
        scale_invariant: bool = 4,
        points: Vec<Point> = 5,
        color: Color = 6,
    }

    /// Three points a triangle.
    TriangleListPrimitive = "TriangleListPrimitive" {
        pose: Pose = 1,
        points: Vec<Point> = 2,
        color: Color = 3,
    }

    SceneEntity = "SceneEntity" {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        id: String = 3,
        frame_locked: bool = 5,
        lines: Vec<LinePrimitive> = 11,
        triangles: Vec<TriangleListPrimitive> = 12,
    }

    SceneUpdate = "SceneUpdate" {
        entities: Vec<SceneEntity> = 2,
    }

    PackedElementField = "PackedElementField" {
        name: String = 1,
        offset: u32 = 2,
        r#type: NumericType = 3,
    } + NumericType

    PointCloud = "PointCloud" {
        timestamp: Timestamp = 1,
        frame_id: String = 2,
        pose: Pose = 3,
        point_stride: u32 = 4,
        fields: Vec<PackedElementField> = 5,
        data: Vec<u8> = 6,
    }
}

/// The data of the schemas of all these messages.
pub fn schema() -> Vec<u8> {
    let time = "google.protobuf";
    [file(time, &[], &times()), file("foxglove", &[time], &all())].concat()
}

/// An enumeration: a number with a name.
macro_rules! enumeration {
    ($(#[$doc:meta])* $name:ident in $message:literal: $values:expr; $($constant:ident = $number:literal)+) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
        pub struct $name(u64);

        impl $name {
            $(pub const $constant: Self = Self($number);)+

            fn descriptor() -> Vec<u8> {
                enumeration(stringify!($name), &$values)
            }
        }

        impl FieldValue for $name {
            const TYPE: u64 = 14;
            const TYPE_NAME: &'static str = concat!($message, ".", stringify!($name));

            fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                self.0.put(number, bytes);
            }
        }
    };
}

enumeration! {
    Level in "foxglove.Log": ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    INFO = 2 WARNING = 3 ERROR = 4
}

enumeration! {
    NumericType in "foxglove.PackedElementField":
        ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];
    FLOAT32 = 7
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
