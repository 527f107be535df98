//! An MCAP file of ROS 2 with `PointCloud2` messages, and with `Odometry` if it has the poses.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use closecall_traffic::input;
use mcap::McapError;
use mcap::parse_record;
use mcap::records::Record;

use super::cdr::{odometry, point_cloud};
use super::error::{Origin, ScanFileError, ScanFileProblem};
use super::options::{ScanOptions, TakenScan};
use super::poses::Poses;
use crate::mcap_records::{McapRecords, RawRecord};

const POINT_CLOUD: &str = "sensor_msgs/msg/PointCloud2";
const ODOMETRY: &str = "nav_msgs/msg/Odometry";
/// The encoding of the messages of ROS 2.
const CDR: &str = "cdr";

/// Greatest size of a record, such as a chunk (bytes): a damaged length must not take all memory.
const MAX_RECORD: usize = 1 << 30;

/// A channel: its topic, and the type and the encoding of its messages.
#[derive(Clone, Debug)]
struct Channel {
    topic: String,
    message: String,
    encoding: String,
}

/// A message of one of the two types.
struct Message {
    channel: Channel,
    /// Number of the message in the channel, from 0.
    number: usize,
    data: Vec<u8>,
}

/// The messages of a file, one after the other.
struct Messages {
    origin: Origin,
    records: McapRecords<BufReader<File>>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    counts: BTreeMap<u16, usize>,
}

impl Messages {
    fn open(path: &Path) -> Result<Self, ScanFileError> {
        let origin = Origin::file(path);
        let file = BufReader::new(input::open(path).map_err(|error| origin.error(error))?);
        let (schemas, channels, counts) = Default::default();
        let records = McapRecords::new(file, MAX_RECORD);
        Ok(Self { origin, records, schemas, channels, counts })
    }

    /// Returns the next point cloud or odometry.
    fn next(&mut self) -> Result<Option<Message>, ScanFileError> {
        let of_mcap = |origin: &Origin, error: McapError| {
            let text = match error {
                McapError::Io(error) => return origin.error(error),
                McapError::UnsupportedCompression(kind) => {
                    format!("a chunk has the compression `{kind}`, but `lz4`, `zstd` and none are read")
                }
                McapError::BadMagic => "it does not begin as MCAP files do".to_owned(),
                other => other.to_string(),
            };
            origin.error(ScanFileProblem::Mcap(text))
        };
        while let Some(RawRecord { opcode, data }) =
            self.records.next().map_err(|error| of_mcap(&self.origin, error))?
        {
            match parse_record(opcode, &data).map_err(|error| of_mcap(&self.origin, error))? {
                Record::Schema { header, .. } => {
                    self.schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) => {
                    let message = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    let (topic, encoding) = (channel.topic, channel.message_encoding);
                    self.channels.insert(channel.id, Channel { topic, message, encoding });
                }
                Record::Message { header, data } => {
                    let Some(channel) = self.channels.get(&header.channel_id) else { continue };
                    if ![POINT_CLOUD, ODOMETRY].contains(&&*channel.message) {
                        continue;
                    }
                    let count = self.counts.entry(header.channel_id).or_default();
                    let number = *count;
                    *count += 1;
                    return Ok(Some(Message { channel: channel.clone(), number, data: data.into_owned() }));
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

impl Message {
    /// Returns the place of the message in its file.
    fn origin(&self, file: &Origin) -> Origin {
        file.at(format_args!("topic {}, message {}", self.channel.topic, self.number))
    }

    fn check_encoding(&self, file: &Origin) -> Result<(), ScanFileError> {
        let reason = || format!("its encoding is `{}`", self.channel.encoding);
        let message = if self.channel.message == POINT_CLOUD { POINT_CLOUD } else { ODOMETRY };
        match &*self.channel.encoding {
            CDR => Ok(()),
            _ => Err(self.origin(file).error(ScanFileProblem::Message { message, reason: reason() })),
        }
    }
}

/// The file after a first pass, which has collected the poses and the topics.
pub(super) struct BagRecording {
    messages: Messages,
    poses: Option<Poses>,
    /// The LiDAR of each topic, or `None` for a topic that is not needed.
    sensors: BTreeMap<String, Option<usize>>,
}

impl BagRecording {
    pub(super) fn open(path: &Path, options: &ScanOptions) -> Result<Self, ScanFileError> {
        let origin = Origin::file(path);
        let mut messages = Messages::open(path)?;
        let (mut poses, mut odometry_topic, mut topics) = (Vec::new(), None::<String>, Vec::new());
        while let Some(message) = messages.next()? {
            message.check_encoding(&origin)?;
            let topic = &message.channel.topic;
            if message.channel.message == POINT_CLOUD {
                if !topics.contains(topic) {
                    topics.push(topic.clone());
                }
                continue;
            }
            let first = odometry_topic.get_or_insert_with(|| topic.clone());
            if first != topic {
                let text = format!("the topics {first} and {topic} both hold odometry; one is needed");
                return Err(origin.error(ScanFileProblem::Mcap(text)));
            }
            poses.push(odometry(&message.data).map_err(|problem| message.origin(&origin).error(problem))?);
        }
        let poses = match odometry_topic {
            Some(topic) => Some(Poses::new(origin.at(format_args!("topic {topic}")), poses)?),
            None => None,
        };
        if topics.is_empty() {
            let of_topic = |channel: &Channel| format!("{} holds {}", channel.topic, channel.message);
            let others: Vec<String> = messages.channels.values().map(of_topic).collect();
            let others = if others.is_empty() { String::new() } else { format!(": {}", others.join(", ")) };
            return Err(origin.error(ScanFileProblem::NoClouds(others)));
        }
        let sensors = sensors(&topics, options).map_err(|problem| origin.error(problem))?;
        Ok(Self { messages: Messages::open(path)?, poses, sensors })
    }

    /// Returns the poses that the file has.
    pub(super) fn take_poses(&mut self) -> Option<Poses> {
        self.poses.take()
    }

    pub(super) fn next_scan(&mut self, options: &ScanOptions) -> Result<Option<TakenScan>, ScanFileError> {
        while let Some(message) = self.messages.next()? {
            let topic = &message.channel.topic;
            let Some(Some(sensor)) = self.sensors.get(topic).filter(|_| message.channel.message == POINT_CLOUD) else {
                continue;
            };
            let origin = message.origin(&self.messages.origin);
            let points = point_cloud(&message.data)
                .and_then(|(stamp, cloud)| cloud.into_points(stamp, options))
                .map_err(|problem| origin.error(problem))?;
            return Ok(Some(TakenScan { sensor: *sensor, origin, points }));
        }
        Ok(None)
    }
}

/// Returns the LiDAR of each topic.
fn sensors(topics: &[String], options: &ScanOptions) -> Result<BTreeMap<String, Option<usize>>, ScanFileProblem> {
    if let ([topic], [_]) = (topics, &options.lidars[..]) {
        return Ok(BTreeMap::from([(topic.clone(), Some(0))]));
    }
    let of_topic = |topic: &String| {
        let named = topic.split('/').find_map(|part| options.sensor(&part.replace('_', "-")).ok());
        named.map(|sensor| (topic.clone(), sensor))
    };
    let sensors: BTreeMap<String, Option<usize>> = topics.iter().filter_map(of_topic).collect();
    let mut taken: Vec<usize> = sensors.values().flatten().copied().collect();
    taken.sort_unstable();
    if sensors.len() == topics.len() && taken.windows(2).all(|pair| pair[0] != pair[1]) {
        return Ok(sensors);
    }
    Err(ScanFileProblem::Topics { topics: topics.join(", "), lidars: options.lidars.join(", ") })
}
