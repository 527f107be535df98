//! Writes the messages of a run: an MCAP file with all channels, or a trace file for each message
//! type.

use std::collections::BTreeMap;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use closecall_recorded::osi::{DESCRIPTORS, MapAsamOpenDrive};
use closecall_traffic::atomic::{WriteError, write_file};
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use prost::Message;

use super::ground_truth::{VERSION, ground_truth};
use super::recorder::OsiRecorder;
use super::sensor_data::sensor_data;
use crate::date::today;
use crate::exchange::road::UsedRoad;

/// A channel: its message type, its topic, and the short form of the type in names of files.
struct Channel {
    message: &'static str,
    topic: &'static str,
    short: &'static str,
}

const GROUND_TRUTH: Channel = Channel { message: "GroundTruth", topic: "ground_truth", short: "gt" };
const SENSOR_DATA: Channel = Channel { message: "SensorData", topic: "sensor_data", short: "sd" };
const MAP: Channel = Channel { message: "MapAsamOpenDrive", topic: "ground_truth_map", short: "" };

impl OsiRecorder {
    /// Writes the messages, and returns the files. A path that ends in `.mcap` is one file with all
    /// channels and the map. Any other path becomes two trace files in its folder. The standard
    /// gives their names: date, message type, version of OSI, version of protobuf, number of
    /// messages, and the stem of the path.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<Vec<PathBuf>, WriteError> {
        if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("mcap")) {
            let bytes = self.mcap().map_err(|error| WriteError::new(path, io::Error::other(error)))?;
            write_file(path, |file| file.write_all(&bytes))?;
            return Ok(vec![path.to_owned()]);
        }
        let (truth, tracks) = (self.ground_truths(), self.sensor_data());
        let traces = [(GROUND_TRUTH, truth), (SENSOR_DATA, tracks)];
        traces.into_iter().map(|(channel, messages)| self.trace(path, &channel, &messages)).collect()
    }

    /// Returns the part of the road that the run uses.
    fn used_road(&self) -> UsedRoad<'_> {
        let driven = self.steps.iter().flat_map(|step| step.vehicles.iter().map(|moving| moving.state.s_m));
        UsedRoad::new(&self.scenario.road, driven)
    }

    pub(super) fn ground_truths(&self) -> Vec<Vec<u8>> {
        let range_m = self.used_road().range_m();
        let steps = self.steps.iter().enumerate().map(|(index, step)| {
            let range_m = (index == 0 || self.has_lanes_in_each).then_some(range_m);
            ground_truth(&self.scenario, step, range_m, &self.scenario.name).encode_to_vec()
        });
        steps.collect()
    }

    fn sensor_data(&self) -> Vec<Vec<u8>> {
        self.steps.iter().map(|step| sensor_data(&self.scenario, step).encode_to_vec()).collect()
    }

    /// Writes a trace: each message behind its length, in four bytes, the lowest first.
    fn trace(&self, path: &Path, channel: &Channel, messages: &[Vec<u8>]) -> Result<PathBuf, WriteError> {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let version = VERSION.map(|part| part.to_string()).concat();
        let day = today().replace('-', "");
        // No library of protobuf is used that has a version.
        let name = format!("{day}T000000Z_{}_{version}_0_{}_{stem}.osi", channel.short, messages.len());
        let named = path.with_file_name(name);
        write_file(&named, |file| {
            messages.iter().try_for_each(|message| {
                let length = u32::try_from(message.len()).map_err(io::Error::other)?;
                file.write_all(&length.to_le_bytes())?;
                file.write_all(message)
            })
        })?;
        Ok(named)
    }

    fn mcap(&self) -> mcap::McapResult<Vec<u8>> {
        let options = WriteOptions::new().compression(None).library("closecall").profile("");
        let mut writer = options.create(Cursor::new(Vec::new()))?;
        let version = VERSION.map(|part| part.to_string()).join(".");
        let text = |pairs: &[(&str, &str)]| -> BTreeMap<String, String> {
            pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
        };
        writer.write_metadata(&Metadata {
            name: "net.asam.osi.trace".to_owned(),
            metadata: text(&[
                ("version", "1.0.0"),
                ("min_osi_version", &version),
                ("max_osi_version", &version),
                ("description", &self.scenario.name),
            ]),
        })?;
        let of_channel = text(&[("net.asam.osi.trace.channel.osi_version", &version)]);
        let map = MapAsamOpenDrive {
            map_reference: Some(self.scenario.name.clone()),
            open_drive_xml_content: Some(self.used_road().document(&self.scenario.name)),
        };
        let first_ns = self.steps.first().map_or(0, |step| step.time.ns());
        let of_steps = |messages: Vec<Vec<u8>>| -> Vec<(i64, Vec<u8>)> {
            self.steps.iter().map(|step| step.time.ns()).zip(messages).collect()
        };
        let channels = [
            (MAP, vec![(first_ns, map.encode_to_vec())]),
            (GROUND_TRUTH, of_steps(self.ground_truths())),
            (SENSOR_DATA, of_steps(self.sensor_data())),
        ];
        for (channel, messages) in channels {
            let schema = writer.add_schema(&format!("osi3.{}", channel.message), "protobuf", DESCRIPTORS)?;
            let channel_id = writer.add_channel(schema, channel.topic, "protobuf", &of_channel)?;
            for (sequence, (time_ns, data)) in (0..).zip(messages) {
                let log_time = u64::try_from(time_ns).unwrap_or_default();
                let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
                writer.write_to_known_channel(&header, &data)?;
            }
        }
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    }
}
