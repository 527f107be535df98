//! Where the scenarios of a campaign come from, if they were made from recorded traffic: the
//! recorded seconds beside the result.
//!
//! `closecall traffic chain` writes [`Origins`] into the folder of its campaign, and the report has
//! a section of it.

use std::collections::BTreeMap;
use std::fmt;

use closecall_campaign::folder::Folder;
use closecall_campaign::ledger::PairFate;
use closecall_campaign::summary::{Counts, Summary};
use closecall_studies::engagement::Engagement;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input;
use closecall_traffic::words::counted;
use maud::{Markup, PreEscaped, html};
use serde::{Deserialize, Serialize};

use super::findings::Findings;
use super::html::{number, number_heads, table, text_heads};

/// The file in the folder of the campaign.
pub const ORIGINS: &str = "origins.json";

/// The origins of the scenarios of a campaign.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origins {
    /// The trajectory files.
    pub files: Vec<OriginFile>,
    /// Number of lane changes that are approaches.
    pub approaches: usize,
    /// The other lane changes, by the reason.
    pub refused: BTreeMap<String, usize>,
    /// How the encounters were chosen.
    pub choice: String,
    /// The encounters, one for each scenario.
    pub encounters: Vec<Origin>,
}

/// A trajectory file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OriginFile {
    /// The path.
    pub path: String,
    /// BLAKE3 hash of its content.
    pub blake3: String,
    /// Number of tracks.
    pub tracks: usize,
    /// Flaws by their name, with their numbers, as `traffic inspect` counts them.
    pub flaws: BTreeMap<String, usize>,
    /// Number of lane changes.
    pub lane_changes: usize,
    /// Number of lane changes that are critical by at least one metric.
    pub critical: usize,
}

/// The recorded encounter of a scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// The name of the scenario.
    pub scenario: String,
    /// The trajectory file.
    pub file: String,
    /// Track of the rear vehicle.
    pub rear_track: u64,
    /// Track of the ego.
    pub ego_track: u64,
    /// Track of the lead vehicle; `None` if none is recorded within 3 s.
    pub lead_track: Option<u64>,
    /// First second of the file from which values were read.
    pub from_s: f64,
    /// The second of the crossing.
    pub to_s: f64,
    /// Recorded speed of the ego (m/s).
    pub ego_mps: f64,
    /// Highest recorded closing speed (m/s).
    pub closing_mps: f64,
    /// Recorded headway of the rear vehicle at the crossing (s).
    pub crossing_thw_s: f64,
    /// Recorded headway of the ego to the lead vehicle (s).
    pub front_thw_s: Option<f64>,
    /// The metrics that are critical.
    pub critical: Vec<String>,
    /// Distance to the nearest encounter that precedes it in the choice, in standard deviations.
    pub distance_sd: Option<f64>,
    /// Picture of the recorded lane change, relative to the folder.
    pub picture: Option<String>,
    /// Recording (Rerun file) of the recorded lane change, relative to the folder.
    pub recording: Option<String>,
    /// Whether the system engages, once the campaign is over.
    pub engagement: Option<Engagement>,
}

impl Origins {
    /// Reads the origins of a campaign. Returns `None` if it has none.
    pub fn of(folder: &Folder) -> Option<Self> {
        serde_json::from_str(&input::read_text(&folder.file(ORIGINS)).ok()?).ok()
    }

    /// Writes the origins into the folder of the campaign.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be written.
    pub fn write(&self, folder: &Folder) -> Result<(), WriteError> {
        write_file(&folder.file(ORIGINS), |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            file.write_all(b"\n")
        })
    }

    /// Returns how many lane changes became scenarios, and why the others did not, the most
    /// frequent reason first.
    pub fn choice_sentence(&self) -> String {
        let changes: usize = self.files.iter().map(|file| file.lane_changes).sum();
        let mut refused: Vec<(&String, usize)> = self.refused.iter().map(|(reason, count)| (reason, *count)).collect();
        refused.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let refused: Vec<String> = refused.iter().map(|(reason, count)| format!("{reason} ({count})")).collect();
        let refused = match refused.is_empty() {
            true => String::new(),
            false => format!("; lane changes that are not encounters: {}", refused.join("; ")),
        };
        let (approaches, encounters) = (self.approaches, self.encounters.len());
        format!(
            "of {}, {approaches} overtake a vehicle, and {encounters} became scenarios{refused}",
            counted(changes, "lane change")
        )
    }

    /// Returns the engagements of all encounters together; `None` before the campaign is over.
    pub fn engagement(&self) -> Option<Engagement> {
        let mut sum = Engagement::default();
        for origin in &self.encounters {
            let engagement = origin.engagement.as_ref()?;
            sum.engaged += engagement.engaged;
            sum.before_braking += engagement.before_braking;
            for (reason, count) in &engagement.missing {
                *sum.missing.entry(reason.clone()).or_default() += count;
            }
        }
        Some(sum)
    }
}

impl Origin {
    /// Returns the most frequent reason for which the system does not engage, with the number of
    /// its samples.
    fn reason(&self) -> Option<(&str, u64)> {
        let most = self.engagement.as_ref()?.missing.iter().max_by_key(|(_, count)| **count)?;
        Some((most.0, *most.1))
    }
}

/// The encounters with their results, as a table for human readers.
#[derive(Clone, Copy, Debug)]
pub struct OriginsText<'a> {
    /// The origins of the encounters.
    pub origins: &'a Origins,
    /// The results of the encounters.
    pub summary: &'a Summary,
}

impl fmt::Display for OriginsText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width =
            self.origins.encounters.iter().map(|encounter| encounter.scenario.len()).max().unwrap_or_default().max(9);
        writeln!(
            f,
            "{:<width$}  recorded          closing  headway   prevented induced both neither  engaged  mostly missing where not",
            "encounter"
        )?;
        for origin in &self.origins.encounters {
            let pairs = counts_of(self.summary, &origin.scenario).map(|counts| counts.pairs).unwrap_or_default();
            let engaged =
                origin.engagement.as_ref().map(|engagement| format!("{}/{}", engagement.engaged, engagement.samples()));
            writeln!(
                f,
                "{:<width$}  {:>6.1} to {:>6.1} s {:>4.1} m/s {:>6.2} s {:>10} {:>7} {:>4} {:>7} {:>8}  {}",
                origin.scenario,
                origin.from_s,
                origin.to_s,
                origin.closing_mps,
                origin.crossing_thw_s,
                pairs.prevented,
                pairs.induced,
                pairs.both,
                pairs.neither,
                engaged.unwrap_or_default(),
                origin.reason().map_or("-", |(reason, _)| reason),
            )?;
        }
        writeln!(f, "{}", self.origins.choice_sentence())?;
        self.origins.engagement().map_or(Ok(()), |all| writeln!(f, "{}", engaged_sentence(&all)))
    }
}

/// Returns the share of the samples in which the system engages, and the missing conditions in the
/// rest.
fn engaged_sentence(all: &Engagement) -> String {
    let (engaged, samples) = (all.engaged, all.samples());
    let share = 100.0 * engaged as f64 / samples.max(1) as f64;
    let mut missing: Vec<(&String, u64)> = all.missing.iter().map(|(reason, count)| (reason, *count)).collect();
    missing.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let rest: Vec<String> = missing.iter().map(|(reason, count)| format!("{reason} ({count})")).collect();
    let rest = match rest.is_empty() {
        true => String::new(),
        false => format!("; in the rest, missing at the closest approach: {}", rest.join(", ")),
    };
    let before = all.before_braking;
    format!(
        "the system engages in {engaged} of {} ({share:.0} %), in {before} before the lead vehicle brakes{rest}",
        counted(samples, "sample")
    )
}

fn counts_of<'a>(summary: &'a Summary, name: &str) -> Option<&'a Counts> {
    summary.scenarios.iter().find(|(scenario, _)| scenario == name).map(|(_, counts)| counts)
}

/// Returns the section of the report. A campaign whose scenarios do not come from recorded traffic
/// has none.
pub(super) fn section(findings: &Findings<'_>) -> Markup {
    let Some((folder, origins)) = findings.folder.and_then(|folder| Some((folder, Origins::of(folder)?))) else {
        return html! {};
    };
    let changes: usize = origins.files.iter().map(|file| file.lane_changes).sum();
    html! {
        h2 { "Recorded encounters" }
        p {
            (counted(origins.files.len(), "trajectory file")) @if origins.files.len() == 1 { " has " } @else { " have " }
            (counted(changes, "lane change")) ". Of these, " (origins.approaches) " overtake a vehicle. "
            (origins.encounters.len()) " of them became scenarios. " (origins.choice)
        }
        @if let Some(all) = origins.engagement() { p { "Over all encounters " (engaged_sentence(&all)) "." } }
        (files_table(&origins))
        @if !origins.refused.is_empty() {
            p {
                "Lane changes that are not encounters: "
                @for (number, (reason, count)) in origins.refused.iter().enumerate() {
                    @if number > 0 { "; " } (reason) " (" (count) ")"
                }
                "."
            }
        }
        (encounters_table(findings, &origins))
        @for origin in &origins.encounters { (encounter(findings, folder, origin)) }
    }
}

fn files_table(origins: &Origins) -> Markup {
    let rows = html! {
        @for file in &origins.files {
            tr {
                td { code { (file.path) } }
                (number(file.tracks)) (number(file.lane_changes)) (number(file.critical))
                td { @for (name, count) in &file.flaws { (count) " " (name) ". " } }
            }
        }
    };
    let head = html! {
        (text_heads(&["file"])) (number_heads(&["tracks", "lane changes", "critical"])) (text_heads(&["flaws"]))
    };
    table(&head, &rows)
}

fn encounters_table(findings: &Findings<'_>, origins: &Origins) -> Markup {
    let rows = html! {
        @for origin in &origins.encounters {
            @let pairs = counts_of(findings.summary, &origin.scenario).map(|counts| counts.pairs).unwrap_or_default();
            tr {
                td.whole { a href={ "#origin-" (origin.scenario) } { (origin.scenario) } }
                td.whole { (format!("{:.1} to {:.1} s", origin.from_s, origin.to_s)) }
                (number(format!("{:.1}", origin.ego_mps)))
                (number(format!("{:.1}", origin.closing_mps)))
                (number(format!("{:.2}", origin.crossing_thw_s)))
                (number(origin.front_thw_s.map_or_else(|| "drawn".to_owned(), |thw_s| format!("{thw_s:.2}"))))
                (number(pairs.prevented)) (number(pairs.induced)) (number(pairs.both)) (number(pairs.neither))
                @match &origin.engagement {
                    Some(engagement) => { (number(engagement.engaged)) (number(engagement.before_braking)) },
                    None => { (number("-")) (number("-")) },
                }
                td { (origin.reason().map_or_else(|| "-".to_owned(), |(reason, count)| format!("{reason} ({count})"))) }
            }
        }
    };
    let head = html! {
        (text_heads(&["encounter", "recorded"]))
        (number_heads(&[
            "ego [m/s]", "closing [m/s]", "headway [s]", "front [s]", "prevented", "induced", "both", "neither",
            "engaged", "before braking",
        ]))
        (text_heads(&["mostly missing in the rest"]))
    };
    table(&head, &rows)
}

/// Returns the recorded seconds of an encounter, and the recordings of its samples.
fn encounter(findings: &Findings<'_>, folder: &Folder, origin: &Origin) -> Markup {
    let picture = origin.picture.as_ref().and_then(|path| input::read_text(&folder.file(path)).ok());
    let of_scenario = findings.recordings.iter().filter(|((name, _, _), _)| *name == origin.scenario);
    let samples: BTreeMap<u64, &String> = of_scenario.map(|((_, sample, _), path)| (*sample, path)).collect();
    let lead = origin.lead_track.map_or_else(
        || "no lead vehicle within 3 s, so that its headway is drawn".to_owned(),
        |track| format!("lead vehicle: track {track}"),
    );
    let critical = if origin.critical.is_empty() { "none".to_owned() } else { origin.critical.join(", ") };
    html! {
        h3 id={ "origin-" (origin.scenario) } { (origin.scenario) }
        p {
            (origin.file) ", " (format!("{:.1} to {:.1} s", origin.from_s, origin.to_s)) ". Rear vehicle: track " (origin.rear_track)
            ", ego: track " (origin.ego_track) ", " (lead) ". Critical metrics: " (critical) ". "
            "Scenario: " a href={ "scenarios/" (origin.scenario) ".toml" } { (origin.scenario) ".toml" } "."
        }
        div.pair {
            figure {
                @if let Some(picture) = picture { (PreEscaped(without_declaration(&picture))) }
                figcaption {
                    "Recorded: track " (origin.rear_track) ", the rear vehicle, is pink; track " (origin.ego_track) ", the ego, is blue. "
                    @if let Some(path) = &origin.recording { a href=(path) { (path) } }
                }
            }
            @for (sample, path) in &samples {
                figure {
                    @if let Ok(picture) = input::read_text(&folder.file(&svg_of(path))) {
                        (PreEscaped(without_declaration(&picture)))
                    }
                    figcaption {
                        "Simulated: sample " (sample) ", "
                        (fate_of(findings, &origin.scenario, *sample)) ". "
                        a href=(path.as_str()) { (path) } " "
                        a href={ "recordings/index.html#" (origin.scenario) "-" (sample) } { "numbers" }
                    }
                }
            }
        }
    }
}

/// Returns the picture beside a recording.
fn svg_of(recording: &str) -> String {
    format!("{}.svg", recording.trim_end_matches(".rrd"))
}

/// Returns an SVG file as it can stand in a page.
fn without_declaration(svg: &str) -> &str {
    svg.find("<svg").map_or(svg, |start| &svg[start..])
}

/// Returns what became of a recorded sample, in a word.
fn fate_of(findings: &Findings<'_>, scenario: &str, sample: u64) -> &'static str {
    let records = findings.folder.and_then(|folder| folder.records().ok());
    let record = records.and_then(|mut records| {
        records.find_map(|record| record.ok().filter(|record| record.scenario == scenario && record.sample == sample))
    });
    let tallies = record.map(|record| record.tallies()).unwrap_or_default();
    match &tallies[..] {
        [baseline, .., tested] => match PairFate::of(baseline, tested) {
            Some(PairFate::Prevented) => "collision prevented",
            Some(PairFate::Induced) => "collision induced",
            Some(PairFate::Both) => "collision in both arms",
            Some(PairFate::Neither) => "no collision",
            None => "no outcome",
        },
        _ => "one controller",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reasons_against_lane_changes_are_named_the_most_frequent_first() {
        let file = |lane_changes| OriginFile { lane_changes, ..OriginFile::default() };
        let chosen = Origins {
            files: vec![file(20), file(13)],
            approaches: 18,
            refused: [("no vehicle ahead".to_owned(), 5), ("too slow".to_owned(), 10)].into(),
            encounters: vec![Origin::default(), Origin::default()],
            ..Origins::default()
        };
        assert_eq!(
            chosen.choice_sentence(),
            "of 33 lane changes, 18 overtake a vehicle, and 2 became scenarios; lane changes that are not encounters: too slow (10); \
             no vehicle ahead (5)"
        );
        let all = Origins { refused: BTreeMap::new(), ..chosen };
        assert!(all.choice_sentence().ends_with("became scenarios"));
    }
}
