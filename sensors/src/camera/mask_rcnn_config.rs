//! The configuration of the pipeline `mask-rcnn`.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::image::CHANNELS;
use super::labels::LabelMap;
use super::picture::WIDTH_PX;
use crate::kept::kept;

/// Share of the vehicles from [`SHIPPED_MIN_SHOWN_PX`] on that the shipped network misses at a
/// score of 0.5, on the held-out renders of all lights and weathers (`models/MASK_RCNN_CARD.md`).
pub const SHIPPED_MISSED: f64 = 0.074;
/// Visible width of the vehicles of that share (px).
pub const SHIPPED_MIN_SHOWN_PX: f64 = 20.0;
/// Share of missed vehicles at which an image is no evidence about vehicles that it does not show.
const UNKNOWN_MISSED: f64 = 1.0;

/// The values that a network takes for the colours of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MaskRcnnInput {
    /// Red, green and blue, 0 to 1: the shipped network and the networks of torchvision, which
    /// normalise by themselves.
    #[default]
    Rgb,
    /// Blue, green and red, 0 to 255 less the means 102.9801, 115.9465 and 122.7717: the Mask R-CNN
    /// of the ONNX model zoo.
    BgrMean,
}

impl MaskRcnnInput {
    /// Means of blue, green and red that [`Self::BgrMean`] subtracts: section *Preprocessing steps*
    /// of `vision/object_detection_segmentation/mask-rcnn` in github.com/onnx/models.
    const MEANS: [f32; CHANNELS] = [102.9801, 115.9465, 122.7717];

    /// Returns the plane of a channel (0 red, 1 green, 2 blue), and its value for the 8-bit value
    /// of that channel.
    pub(super) fn place(self, channel: usize, value: u8) -> (usize, f32) {
        match self {
            Self::Rgb => (channel, f32::from(value) / 255.0),
            Self::BgrMean => {
                let plane = CHANNELS - 1 - channel;
                (plane, f32::from(value) - Self::MEANS[plane])
            }
        }
    }
}

/// The Mask R-CNN of a rear camera as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct MaskRcnnConfig {
    /// Number of images per second (Hz). An image is taken with the first scan of the LiDAR that is
    /// due.
    pub rate_hz: Num,
    /// Time from the exposure to the result (s), rounded up to the next scan of the LiDAR. The
    /// result applies to the objects that were there at the exposure.
    pub latency_s: Num,
    /// ONNX file of another network, relative to the working directory: a Mask R-CNN, or a detector
    /// without masks. Default: none; the one that ships with Closecall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Labels of the other network, such as `3=car 4=motorcycle 8=truck`. Default: none; the labels
    /// in the network's metadata.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<String>,
    /// What the network takes for the colours of a pixel.
    pub input: MaskRcnnInput,
    /// Share of the vehicles from `min-shown-px` on that the network misses at a score of 0.5 (0 to
    /// 1): how much a cluster loses that no instance overlaps. Default: 0.074 for the shipped
    /// network, as measured; 1 for another network, whose image then says nothing about such a
    /// cluster.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed: Option<Num>,
    /// Visible width from which `missed` applies (px). Default: 20.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_shown_px: Option<Num>,
}

impl Default for MaskRcnnConfig {
    /// Returns rate and latency of the original: 195 ms per image, 5 frames per second (K. He et
    /// al., *Mask R-CNN*, 2017).
    fn default() -> Self {
        Self {
            rate_hz: Num::Fixed(5.0),
            latency_s: Num::Fixed(0.2),
            model: None,
            labels: None,
            input: MaskRcnnInput::Rgb,
            missed: None,
            min_shown_px: None,
        }
    }
}

/// The checked configuration of the Mask R-CNN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskRcnn {
    /// Time from one image to the next (s).
    pub period_s: f64,
    /// Time from the exposure to the result (s).
    pub latency_s: f64,
    /// ONNX file of another network.
    pub model: Option<&'static str>,
    /// Labels of the other network.
    pub labels: Option<&'static str>,
    /// What the network takes for the colours of a pixel.
    pub input: MaskRcnnInput,
    /// Share of the vehicles from `min_shown_px` on that the network misses (0 to 1). At 1, the
    /// image says nothing about what it does not show.
    pub missed: f64,
    /// Visible width from which the network would find a vehicle (px).
    pub min_shown_px: f64,
}

impl Check for MaskRcnnConfig {
    type Checked = MaskRcnn;

    fn check(&self, parameters: &Parameters) -> Result<MaskRcnn, ConfigError> {
        let rate_hz = parameters.number(&self.rate_hz, "rate-hz", Range::closed(1.0, 25.0))?;
        if let Some(labels) = &self.labels
            && LabelMap::parse(labels).is_err()
        {
            let rule =
                "labels are like \"3=car 4=motorcycle 8=truck\": a number and car, truck or motorcycle".to_owned();
            return Err(ConfigError::new("labels", Problem::Contradiction { other: "labels", rule }));
        }
        let or = |num: &Option<Num>, default: f64| num.clone().unwrap_or(Num::Fixed(default));
        let missed = or(&self.missed, if self.model.is_none() { SHIPPED_MISSED } else { UNKNOWN_MISSED });
        let min_shown_px = or(&self.min_shown_px, SHIPPED_MIN_SHOWN_PX);
        Ok(MaskRcnn {
            input: self.input,
            missed: parameters.number(&missed, "missed", Range::UNIT)?,
            min_shown_px: parameters.number(&min_shown_px, "min-shown-px", Range::closed(1.0, WIDTH_PX.into()))?,
            period_s: 1.0 / rate_hz,
            latency_s: parameters.number(&self.latency_s, "latency-s", Range::closed(0.0, 1.0))?,
            model: self.model.as_deref().map(kept),
            labels: self.labels.as_deref().map(kept),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_latency_and_labels_are_checked() {
        let check = |text: &str| toml::from_str::<MaskRcnnConfig>(text).unwrap().check(&Parameters::default());
        let usual = check("").unwrap();
        assert_eq!((usual.period_s, usual.latency_s, usual.model), (0.2, 0.2, None));
        assert!(check("rate-hz = 0").unwrap_err().to_string().starts_with("`rate-hz` is 0"));
        assert!(check("latency-s = 2").unwrap_err().to_string().starts_with("`latency-s` is 2"));
        assert!(check("labels = '3=bus'").unwrap_err().to_string().contains("3=car 4=motorcycle"));
        assert_eq!((usual.missed, usual.min_shown_px), (SHIPPED_MISSED, SHIPPED_MIN_SHOWN_PX));
        assert_eq!(check("model = 'a.onnx'").unwrap().missed, 1.0, "what another network misses is not known");
        assert_eq!(check("model = 'a.onnx'\nmissed = 0.2").unwrap().missed, 0.2);
        assert!(check("missed = 1.5").unwrap_err().to_string().starts_with("`missed` is 1.5"));
        assert!(check("min-shown-px = 0").unwrap_err().to_string().starts_with("`min-shown-px` is 0"));
        let wrong = toml::from_str::<MaskRcnnConfig>("input = 'bgr'").unwrap_err().to_string();
        assert!(wrong.contains("rgb") && wrong.contains("bgr-mean"), "{wrong}");
        let [first, second] = [0, 1].map(|_| check("model = 'a.onnx'").unwrap().model.unwrap());
        assert!(std::ptr::eq(first, second), "a name is kept once");
    }

    #[test]
    fn the_model_card_describes_the_shipped_network() {
        use sha2::{Digest, Sha256};
        let card = include_str!("../../models/MASK_RCNN_CARD.md");
        let bytes = crate::camera::detector::SHIPPED_MASK_RCNN;
        let hash: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        assert!(card.contains(&hash), "the card has not the hash {hash}");
        assert!(card.contains(&format!("{} bytes", bytes.len())));
        let missed =
            format!("**Misses** {:.1} % of the vehicles from {SHIPPED_MIN_SHOWN_PX} px on", 100.0 * SHIPPED_MISSED);
        assert!(card.contains(&missed), "the card does not say {missed:?}");
    }
}
