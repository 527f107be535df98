//! The configuration of the pipeline `mask-rcnn`.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::detector::LabelMap;

/// The Mask R-CNN of the rear camera as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct MaskRcnnConfig {
    /// Number of images per second (Hz). An image is taken with the first scan of the LiDAR that is due.
    pub rate_hz: Num,
    /// Time from the exposure to the result (s), rounded up to the next scan of the LiDAR. The result applies to the objects that were there at
    /// the exposure.
    pub latency_s: Num,
    /// ONNX file of another network, relative to the working directory. Default: none; the one that ships with Closecall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Labels of the other network, such as `3=car 4=motorcycle 8=truck`. Default: none; those of the network's metadata.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<String>,
}

impl Default for MaskRcnnConfig {
    /// Returns rate and latency of the original: 195 ms per image, 5 frames per second (K. He et al., *Mask R-CNN*, 2017).
    fn default() -> Self {
        Self { rate_hz: Num::Fixed(5.0), latency_s: Num::Fixed(0.2), model: None, labels: None }
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
        Ok(MaskRcnn {
            period_s: 1.0 / rate_hz,
            latency_s: parameters.number(&self.latency_s, "latency-s", Range::closed(0.0, 1.0))?,
            model: self.model.as_deref().map(kept),
            labels: self.labels.as_deref().map(kept),
        })
    }
}

/// Returns the same text, which is kept until the process ends. Each text is kept once.
fn kept(text: &str) -> &'static str {
    static KEPT: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut all = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = all.get(text) {
        return known;
    }
    let leaked: &'static str = Box::leak(text.to_owned().into_boxed_str());
    all.insert(leaked);
    leaked
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
        let [one, other] = [0, 1].map(|_| check("model = 'a.onnx'").unwrap().model.unwrap());
        assert!(std::ptr::eq(one, other), "a name is kept once");
    }
}
