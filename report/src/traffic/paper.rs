//! The figures of the published method on any set of trajectory files, as pictures and one page.
//!
//! | figure | content | files |
//! |---|---|---|
//! | 3 | what each criterion finds over noise and over offset, and where it fails in each trajectory file | `figure-3-noise.svg`, `figure-3-offset.svg` |
//! | 5 | durations, peak widths and speeds of complete lane changes, by vehicle class and by trajectory file | `figure-5-….svg` |
//! | 6 | histograms of the seven metrics with their thresholds | `figure-6-….svg` |
//! | 7 | critical shares to the left and to the right, with exact intervals | `figure-7-shares.svg` |

use closecall_campaign::robustness::StudiedFiles;
use closecall_recorded::criticality::{CriticalLaneChange, Statistics, statistics};
use closecall_recorded::robustness::Robustness;
use maud::{PreEscaped, html};

use super::paper_charts::{METRICS, histogram, share_chart};
use super::robustness::{RobustnessText, robustness_charts};
use super::statistics::{BOXED, Boxed, RecordedChanges, StatisticsText, box_chart, by_class, summary};
use super::trajectory_charts::{BoxSummary, ChartError};
use crate::campaign::html::page::{document, head, table};

/// The title of the page.
const TITLE: &str = "Recorded lane changes";

/// A picture of the page.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Number of the figure in the published method.
    pub figure: u32,
    /// Name of the file.
    pub name: String,
    /// The picture (SVG).
    pub svg: String,
}

/// The figures, and the page that holds them.
#[derive(Clone, Debug)]
pub struct Paper {
    /// The pictures, in the order of the figures.
    pub pictures: Vec<Picture>,
    /// The page (HTML), which holds the pictures.
    pub page: String,
}

impl Paper {
    /// Draws the figures. `robustness` holds the result for each trajectory file, and the result
    /// for all files together.
    ///
    /// # Errors
    /// [`ChartError`] if a figure cannot be drawn.
    pub fn new(
        recordings: &[RecordedChanges],
        robustness: Option<&StudiedFiles>,
        speed_limit_mps: Option<f64>,
    ) -> Result<Self, ChartError> {
        let all: Vec<CriticalLaneChange> =
            recordings.iter().flat_map(|recording| recording.changes.iter().cloned()).collect();
        let mut pictures = Vec::new();
        let mut push = |figure: u32, name: &str, svg: String| {
            pictures.push(Picture { figure, name: format!("figure-{figure}-{name}.svg"), svg });
        };
        if let Some(StudiedFiles { all: together, .. }) = robustness {
            let [noise, offset] = robustness_charts(together)?;
            push(3, "noise", noise);
            push(3, "offset", offset);
        }
        for boxed in &BOXED {
            push(5, &format!("{}-by-class", boxed.file), box_chart(boxed, by_class(&all, boxed)).svg()?);
            push(5, &format!("{}-by-file", boxed.file), box_chart(boxed, by_file(recordings, boxed)).svg()?);
        }
        for metric in METRICS {
            push(6, metric, histogram(&all, metric, speed_limit_mps)?);
        }
        push(7, "shares", share_chart(&all)?);
        let page = page(recordings, &statistics(&all), robustness, &pictures);
        Ok(Self { pictures, page })
    }
}

fn by_file(recordings: &[RecordedChanges], boxed: &Boxed) -> Vec<BoxSummary> {
    recordings.iter().filter_map(|recording| summary(&recording.name, recording.changes.iter(), boxed)).collect()
}

/// Returns the lowest level of noise at which each criterion fails, for each trajectory file.
fn failures(recordings: &[RecordedChanges], each: &[Robustness]) -> Vec<Vec<String>> {
    let row = |(recording, robustness): (&RecordedChanges, &Robustness)| {
        let level =
            |column: usize| match (robustness.undisturbed[column], robustness.failing_noise_m_per_sqrt_s(column)) {
                (0, _) => "finds nothing".to_owned(),
                (_, Some(level)) => format!("{level} m/√s"),
                (_, None) => "no level".to_owned(),
            };
        std::iter::once(recording.name.clone()).chain((0..robustness.criteria.len()).map(level)).collect()
    };
    recordings.iter().zip(each).map(row).collect()
}

fn page(
    recordings: &[RecordedChanges],
    statistics: &Statistics,
    robustness: Option<&StudiedFiles>,
    pictures: &[Picture],
) -> String {
    let names: Vec<&str> = recordings.iter().map(|recording| recording.name.as_str()).collect();
    let figure = |number: u32| pictures.iter().filter(move |picture| picture.figure == number);
    let drawn = |number: u32| {
        html! {
            div.drawings { @for picture in figure(number) { figure.broad tabindex="0" { (PreEscaped(&picture.svg)) } } }
        }
    };
    let body = html! {
        (head(TITLE, &[], &format!("Trajectory files: {}", names.join(", "))))
        @if let Some(StudiedFiles { each, all: together, .. }) = robustness {
            h2 { "Figure 3: what the criteria tolerate" }
            (drawn(3))
            h3 { "Lowest level of noise at which a criterion fails" }
            (table(
                &html! { th { "trajectory file" } @for criterion in &together.criteria { th { (criterion.name()) } } },
                &html! { @for row in failures(recordings, each) { tr { @for cell in row { td { (cell) } } } } },
            ))
            pre { (RobustnessText(together).to_string()) }
        }
        h2 { "Figure 5: durations, peak widths and speeds" }
        (drawn(5))
        pre { (StatisticsText(statistics).to_string()) }
        h2 { "Figure 6: how often the values of each metric occur" }
        (drawn(6))
        h2 { "Figure 7: critical shares to the left and to the right" }
        (drawn(7))
    };
    document(TITLE, &body).into_string()
}
