//! Reads messages of ROS 2 in CDR, the encoding of DDS (OMG *Common Data Representation*, version
//! 1). The messages are `sensor_msgs/msg/PointCloud2` and `nav_msgs/msg/Odometry`.

use closecall_traffic::{Time, maths};

use super::cloud::{Cloud, Field, Number, PointBytes};
use super::error::ScanFileProblem;
use super::poses::Pose;

/// Number of bytes before the message: the representation and its options.
const ENCAPSULATION: usize = 4;
/// Representation of little-endian CDR.
const LITTLE_ENDIAN: [u8; 2] = [0, 1];
/// Representation of big-endian CDR.
const BIG_ENDIAN: [u8; 2] = [0, 0];
/// Difference up to which the norm of a rotation is 1 (assumption): rounding to three digits.
const UNIT_TOLERANCE: f64 = 0.01;
/// Number of elements of a covariance matrix.
const COVARIANCE: usize = 36;

/// Reads the values of a message one after the other.
struct Cdr<'a> {
    bytes: &'a [u8],
    /// Index of the next byte.
    position: usize,
    message: &'static str,
}

impl<'a> Cdr<'a> {
    fn new(bytes: &'a [u8], message: &'static str) -> Result<Self, ScanFileProblem> {
        let representation = bytes.first_chunk::<2>().copied();
        match representation {
            Some(LITTLE_ENDIAN) if bytes.len() >= ENCAPSULATION => {
                Ok(Self { bytes: &bytes[ENCAPSULATION..], position: 0, message })
            }
            Some(BIG_ENDIAN) => Err(ScanFileProblem::BigEndian("the values of the message")),
            _ => Err(ScanFileProblem::Message { message, reason: "it does not begin with 00 01".to_owned() }),
        }
    }

    fn take(&mut self, length: usize, what: &'static str) -> Result<&'a [u8], ScanFileProblem> {
        let taken = self.bytes.get(self.position..).and_then(|rest| rest.get(..length));
        let short = || ScanFileProblem::Message { message: self.message, reason: format!("it ends before `{what}`") };
        let taken = taken.ok_or_else(short)?;
        self.position += length;
        Ok(taken)
    }

    /// Takes a value of `N` bytes. It begins at a multiple of `N` bytes.
    fn aligned<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], ScanFileProblem> {
        self.position = self.position.next_multiple_of(N);
        let mut value = [0; N];
        value.copy_from_slice(self.take(N, what)?);
        Ok(value)
    }

    fn u32(&mut self, what: &'static str) -> Result<usize, ScanFileProblem> {
        Ok(u32::from_le_bytes(self.aligned(what)?) as usize)
    }

    fn f64(&mut self, what: &'static str) -> Result<f64, ScanFileProblem> {
        let value = f64::from_le_bytes(self.aligned(what)?);
        let reason = || format!("`{what}` is {value}, but a finite number is needed");
        if value.is_finite() {
            Ok(value)
        } else {
            Err(ScanFileProblem::Message { message: self.message, reason: reason() })
        }
    }

    fn string(&mut self, what: &'static str) -> Result<String, ScanFileProblem> {
        let length = self.u32(what)?;
        let bytes = self.take(length, what)?;
        Ok(String::from_utf8_lossy(bytes.strip_suffix(&[0]).unwrap_or(bytes)).into_owned())
    }

    /// Takes a header, and returns its stamp and its frame.
    fn header(&mut self) -> Result<(Time, String), ScanFileProblem> {
        const NS_PER_S: i64 = 1_000_000_000;
        let seconds = i32::from_le_bytes(self.aligned("header.stamp.sec")?);
        let nanoseconds = u32::from_le_bytes(self.aligned("header.stamp.nanosec")?);
        let frame = self.string("header.frame_id")?;
        Ok((Time::from_ns(i64::from(seconds) * NS_PER_S + i64::from(nanoseconds)), frame))
    }
}

/// Frames that do not move (REP 105 of ROS).
const FIXED_FRAMES: [&str; 3] = ["earth", "map", "odom"];

/// Returns the stamp and the points of a `PointCloud2`.
pub(super) fn point_cloud(bytes: &[u8]) -> Result<(Time, Cloud), ScanFileProblem> {
    const MESSAGE: &str = "sensor_msgs/msg/PointCloud2";
    let mut cdr = Cdr::new(bytes, MESSAGE)?;
    let wrong = |reason: String| ScanFileProblem::Message { message: MESSAGE, reason };
    let (stamp, frame) = cdr.header()?;
    if FIXED_FRAMES.contains(&frame.trim_start_matches('/')) {
        return Err(wrong(format!("its frame is `{frame}`, which does not move with the sensor or the ego")));
    }
    let (height, width) = (cdr.u32("height")?, cdr.u32("width")?);
    let count = cdr.u32("fields")?;
    let mut fields = Vec::new();
    for _ in 0..count {
        let name = cdr.string("fields.name")?;
        let offset = cdr.u32("fields.offset")?;
        let [datatype] = cdr.aligned("fields.datatype")?;
        cdr.u32("fields.count")?;
        let number = match datatype {
            1 => Number::I8,
            2 => Number::U8,
            3 => Number::I16,
            4 => Number::U16,
            5 => Number::I32,
            6 => Number::U32,
            7 => Number::F32,
            8 => Number::F64,
            _ => return Err(wrong(format!("the field `{name}` has the datatype {datatype}; 1 to 8 are known"))),
        };
        fields.push(Field { name, number, offset });
    }
    if cdr.aligned("is_bigendian")? != [0_u8] {
        return Err(ScanFileProblem::BigEndian("the points of the message"));
    }
    let (point_step, row_step) = (cdr.u32("point_step")?, cdr.u32("row_step")?);
    let length = cdr.u32("data")?;
    let data = cdr.take(length, "data")?;
    if point_step == 0 || width.checked_mul(point_step).is_none_or(|least| row_step < least) {
        return Err(wrong(format!("rows of {row_step} bytes do not hold {width} points of {point_step} bytes")));
    }
    if height.checked_mul(row_step) != Some(data.len()) {
        return Err(wrong(format!(
            "`data` has {} bytes, but {height} rows of {row_step} bytes are stated",
            data.len()
        )));
    }
    // Rows may end with bytes that belong to no point.
    let points: Vec<u8> = match row_step == width * point_step {
        true => data.to_vec(),
        false => data.chunks(row_step).flat_map(|row| &row[..width * point_step]).copied().collect(),
    };
    let points = PointBytes { bytes: &points, count: width * height, stride: point_step };
    Ok((stamp, Cloud::of_bytes(&fields, points)?))
}

/// Returns the pose of an `Odometry`.
pub(super) fn odometry(bytes: &[u8]) -> Result<Pose, ScanFileProblem> {
    const MESSAGE: &str = "nav_msgs/msg/Odometry";
    let mut cdr = Cdr::new(bytes, MESSAGE)?;
    let (time, _) = cdr.header()?;
    cdr.string("child_frame_id")?;
    let mut numbers = |what| Ok::<_, ScanFileProblem>([cdr.f64(what)?, cdr.f64(what)?, cdr.f64(what)?]);
    let [x_m, y_m, _] = numbers("pose.pose.position")?;
    let [x, y, z] = numbers("pose.pose.orientation")?;
    let w = cdr.f64("pose.pose.orientation")?;
    let norm = (x * x + y * y + z * z + w * w).sqrt();
    if !((norm - 1.0).abs() <= UNIT_TOLERANCE) {
        let reason = format!("`pose.pose.orientation` has the norm {norm}, but a rotation has 1");
        return Err(ScanFileProblem::Message { message: MESSAGE, reason });
    }
    cdr.position = cdr.position.next_multiple_of(size_of::<f64>());
    cdr.take(COVARIANCE * size_of::<f64>(), "pose.covariance")?;
    let speed_mps = cdr.f64("twist.twist.linear.x")?;
    for what in ["twist.twist.linear.y", "twist.twist.linear.z", "twist.twist.angular.x", "twist.twist.angular.y"] {
        cdr.f64(what)?;
    }
    let yaw_rate_radps = Some(cdr.f64("twist.twist.angular.z")?);
    let yaw_rad = maths::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    // A standing vehicle may measure a speed below 0.
    Ok(Pose { time, at_m: [x_m, y_m], yaw_rad, speed_mps: speed_mps.max(0.0), yaw_rate_radps, on_road: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_a_frame_that_does_not_move_are_refused() {
        for frame in ["map", "/odom", "earth"] {
            let length = u8::try_from(frame.len() + 1).unwrap();
            let mut message = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, length, 0, 0, 0];
            message.extend_from_slice(frame.as_bytes());
            message.push(0);
            let error = point_cloud(&message).err().map(|problem| problem.to_string()).unwrap_or_default();
            assert!(error.contains(&format!("its frame is `{frame}`")), "{error}");
        }
    }
}
