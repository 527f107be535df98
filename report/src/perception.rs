//! A study as text, as JSON, as Parquet, and as a page with charts. With a second study, the page and the text compare the two.

use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};

use crate::json::stamped;
use crate::table::{Column, write_columns};
use closecall_traffic::atomic::{WriteError, write_file};
use serde_json::{Value, json};

use closecall_studies::perception::figures::{CalibrationBin, CurvePoint, Estimate, Figures, PointErrors};
use closecall_studies::perception::study::Study;

mod chart;
mod page;

/// One study, or two that are compared.
#[derive(Clone, Debug)]
pub struct Studies(pub Vec<Study>);

impl Studies {
    /// Returns the studies as JSON: one object, or a list of two.
    pub fn json(&self) -> Value {
        let each = |study: &Study| stamped(study_json(study), Some(study.seed), None);
        match &self.0[..] {
            [one] => each(one),
            all => all.iter().map(each).collect(),
        }
    }

    /// Writes `sensors.json`, `sensors.parquet`, `curves.parquet`, `calibration.parquet` and `sensors.html` into a folder, which is
    /// created if it does not exist. Returns their paths.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be written. An existing file then stays as it is.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, WriteError> {
        std::fs::create_dir_all(folder).map_err(|source| WriteError::new(folder, source))?;
        let names = ["sensors.html", "sensors.json", "sensors.parquet", "curves.parquet", "calibration.parquet"];
        let paths = names.map(|name| folder.join(name));
        let page = page::page(&self.0).into_string();
        write_file(&paths[0], |file| file.write_all(page.as_bytes()))?;
        let text = format!("{:#}\n", self.json());
        write_file(&paths[1], |file| file.write_all(text.as_bytes()))?;
        write_columns(&paths[2], self.figure_columns())?;
        write_columns(&paths[3], self.curve_columns())?;
        write_columns(&paths[4], self.calibration_columns())?;
        Ok(paths.to_vec())
    }

    fn figure_columns(&self) -> Vec<(&'static str, &'static str, Column)> {
        let rows = || self.0.iter().flat_map(|study| study.cases.iter().map(move |(case, of)| (study, case, of)));
        let number = |of: &dyn Fn(&Figures) -> Option<f64>| Column::Number(rows().map(|(_, _, it)| of(it)).collect());
        let value = |of: fn(&Figures) -> Option<Estimate>| number(&|it| of(it).map(|it| it.value));
        let low = |of: fn(&Figures) -> Option<Estimate>| number(&|it| of(it).map(|it| it.interval_95[0]));
        let high = |of: fn(&Figures) -> Option<Estimate>| number(&|it| of(it).map(|it| it.interval_95[1]));
        let mut columns = vec![
            ("configuration", "", Column::Text(rows().map(|(study, _, _)| study.name.clone()).collect())),
            ("sensors", "", Column::Text(rows().map(|(study, _, _)| study.mode.name().to_owned()).collect())),
            ("seed", "", Column::Number(rows().map(|(study, _, _)| Some(study.seed as f64)).collect())),
            ("approaches", "", Column::Number(rows().map(|(study, _, _)| Some(study.runs as f64)).collect())),
            ("factor", "", Column::Text(rows().map(|(_, case, _)| case.factor.to_owned()).collect())),
            ("case", "", Column::Text(rows().map(|(_, case, _)| case.name.clone()).collect())),
        ];
        for (names, unit, of) in FIGURES {
            columns.push((names[0], unit, value(of)));
            columns.push((names[1], unit, low(of)));
            columns.push((names[2], unit, high(of)));
        }
        for (name, unit, of) in PLAIN {
            columns.push((name, unit, number(&of)));
        }
        columns
    }

    fn curve_columns(&self) -> Vec<(&'static str, &'static str, Column)> {
        let rows: Vec<(&Study, &str, &CurvePoint)> = self
            .0
            .iter()
            .flat_map(|study| {
                study.cases.iter().flat_map(move |(case, of)| of.curve.iter().map(move |it| (study, &*case.name, it)))
            })
            .collect();
        let number =
            |of: &dyn Fn(&CurvePoint) -> Option<f64>| Column::Number(rows.iter().map(|row| of(row.2)).collect());
        let mut columns = vec![
            ("configuration", "", Column::Text(rows.iter().map(|row| row.0.name.clone()).collect())),
            ("case", "", Column::Text(rows.iter().map(|row| row.1.to_owned()).collect())),
            ("gap_m", "m", number(&|it| Some(it.gap_m))),
            ("confirmed", "", number(&|it| Some(it.confirmed.value))),
            ("confirmed_low_95", "", number(&|it| Some(it.confirmed.interval_95[0]))),
            ("confirmed_high_95", "", number(&|it| Some(it.confirmed.interval_95[1]))),
        ];
        for (names, unit, index) in CURVE_ERRORS {
            let error = |of: fn(&PointErrors) -> f64| number(&|it| it.errors.map(|errors| of(&errors[index])));
            columns.push((names[0], unit, error(|it| it.bias)));
            columns.push((names[1], unit, error(|it| it.rmse)));
            columns.push((names[2], unit, error(|it| it.q95)));
        }
        columns
    }

    fn calibration_columns(&self) -> Vec<(&'static str, &'static str, Column)> {
        let rows: Vec<(&Study, &str, &CalibrationBin)> = self
            .0
            .iter()
            .flat_map(|study| {
                study
                    .cases
                    .iter()
                    .flat_map(move |(case, of)| of.calibration.iter().map(move |bin| (study, &*case.name, bin)))
            })
            .collect();
        let number = |of: fn(&CalibrationBin) -> f64| Column::Number(rows.iter().map(|row| Some(of(row.2))).collect());
        vec![
            ("configuration", "", Column::Text(rows.iter().map(|row| row.0.name.clone()).collect())),
            ("case", "", Column::Text(rows.iter().map(|row| row.1.to_owned()).collect())),
            ("confidence", "", number(|bin| bin.confidence)),
            ("accuracy", "", number(|bin| bin.accuracy)),
            ("steps", "", number(|bin| bin.steps as f64)),
        ]
    }
}

/// The figures with intervals: the names of value, lower and upper bound, the unit, and the figure.
type Named = ([&'static str; 3], &'static str, fn(&Figures) -> Option<Estimate>);

const FIGURES: [Named; 15] = [
    (["range_m", "range_low_95_m", "range_high_95_m"], "m", |it| Some(it.range_m)),
    (["along_bias_m", "along_bias_low_95_m", "along_bias_high_95_m"], "m", |it| it.errors.map(|it| it[0].bias)),
    (["along_rmse_m", "along_rmse_low_95_m", "along_rmse_high_95_m"], "m", |it| it.errors.map(|it| it[0].rmse)),
    (["across_bias_m", "across_bias_low_95_m", "across_bias_high_95_m"], "m", |it| it.errors.map(|it| it[1].bias)),
    (["across_rmse_m", "across_rmse_low_95_m", "across_rmse_high_95_m"], "m", |it| it.errors.map(|it| it[1].rmse)),
    (["speed_bias_mps", "speed_bias_low_95_mps", "speed_bias_high_95_mps"], "m/s", |it| it.errors.map(|it| it[2].bias)),
    (["speed_rmse_mps", "speed_rmse_low_95_mps", "speed_rmse_high_95_mps"], "m/s", |it| it.errors.map(|it| it[2].rmse)),
    (["confirmed_after_s", "confirmed_after_low_95_s", "confirmed_after_high_95_s"], "s", |it| it.confirmed_after_s),
    (["confirms", "confirms_low_95", "confirms_high_95"], "", |it| Some(it.confirms)),
    (["false_tracks_per_h", "false_tracks_low_95_per_h", "false_tracks_high_95_per_h"], "1/h", |it| {
        Some(it.false_tracks_per_h)
    }),
    (["id_switches", "id_switches_low_95", "id_switches_high_95"], "", |it| Some(it.id_switches)),
    (["unavailable", "unavailable_low_95", "unavailable_high_95"], "", |it| Some(it.unavailable)),
    (["gospa_m", "gospa_low_95_m", "gospa_high_95_m"], "m", |it| Some(it.gospa_m)),
    (["class_accuracy", "class_accuracy_low_95", "class_accuracy_high_95"], "", |it| it.class_accuracy),
    (["nees", "nees_low_95", "nees_high_95"], "", |it| it.nees),
];

/// The figures without intervals: name, unit, and the figure.
type Plain = (&'static str, &'static str, fn(&Figures) -> Option<f64>);

const PLAIN: [Plain; 4] = [
    ("along_q95_m", "m", |it| it.errors.map(|it| it[0].q95)),
    ("across_q95_m", "m", |it| it.errors.map(|it| it[1].q95)),
    ("speed_q95_mps", "m/s", |it| it.errors.map(|it| it[2].q95)),
    ("calibration_error", "", |it| it.calibration_error),
];

/// The errors of a curve: names of bias, root mean square and 95 % quantile of the magnitude, unit, and index.
const CURVE_ERRORS: [([&str; 3], &str, usize); 3] = [
    (["along_bias_m", "along_rmse_m", "along_q95_m"], "m", 0),
    (["across_bias_m", "across_rmse_m", "across_q95_m"], "m", 1),
    (["speed_bias_mps", "speed_rmse_mps", "speed_q95_mps"], "m/s", 2),
];

/// Returns the JSON of a value with its interval; a bound that does not exist is `null`.
fn estimate(of: &Estimate) -> Value {
    json!({ "value": of.value, "low_95": of.interval_95[0], "high_95": of.interval_95[1] })
}

fn study_json(study: &Study) -> Value {
    let errors = |of: &Figures| {
        of.errors.map(|errors| {
            let each = |it: &closecall_studies::perception::figures::ErrorFigures| {
                json!({ "bias": estimate(&it.bias), "rmse": estimate(&it.rmse), "q95": it.q95 })
            };
            json!({ "along_m": each(&errors[0]), "across_m": each(&errors[1]), "speed_mps": each(&errors[2]) })
        })
    };
    let point = |it: &CurvePoint| {
        let mut point = json!({ "gap_m": it.gap_m, "confirmed": estimate(&it.confirmed) });
        for (names, _, index) in CURVE_ERRORS {
            let errors = it.errors.map(|errors| errors[index]);
            point[names[0]] = json!(errors.map(|it| it.bias));
            point[names[1]] = json!(errors.map(|it| it.rmse));
            point[names[2]] = json!(errors.map(|it| it.q95));
        }
        point
    };
    let cases: Vec<Value> = study
        .cases
        .iter()
        .map(|(case, of)| {
            json!({
                "factor": case.factor, "case": case.name, "range_m": estimate(&of.range_m), "errors": errors(of),
                "confirmed_after_s": of.confirmed_after_s.as_ref().map(estimate), "confirms": estimate(&of.confirms),
                "false_tracks_per_h": estimate(&of.false_tracks_per_h), "id_switches": estimate(&of.id_switches),
                "unavailable": estimate(&of.unavailable), "gospa_m": estimate(&of.gospa_m), "class_accuracy": of.class_accuracy.as_ref().map(estimate),
                "calibration_error": of.calibration_error, "nees": of.nees.as_ref().map(estimate),
                "calibration": of.calibration.iter().map(|bin| json!({
                    "confidence": bin.confidence, "accuracy": bin.accuracy, "steps": bin.steps,
                })).collect::<Vec<_>>(),
                "curve": of.curve.iter().map(point).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({ "configuration": study.name, "sensors": study.mode.name(), "approaches": study.runs, "cases": cases })
}

impl Display for Studies {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for study in &self.0 {
            let Study { name, mode, runs, seed, .. } = study;
            writeln!(f, "sensors of {name}, mode {}: {runs} approaches of each case, seed {seed}", mode.name())?;
            writeln!(
                f,
                "  {:<44} {:>17} {:>9} {:>9} {:>9} {:>8} {:>7} {:>6}",
                "case", "first track (m)", "along (m)", "across (m)", "v (m/s)", "false/h", "class", "NEES"
            )?;
            for (case, of) in &study.cases {
                let [low, high] = of.range_m.interval_95;
                let range = format!("{:.0} ({low:.0} to {high:.0})", of.range_m.value);
                let rmse = |index: usize| number(of.errors.map(|errors| errors[index].rmse.value), 2);
                let class = number(of.class_accuracy.map(|it| 100.0 * it.value), 0);
                let (false_tracks, nees) = (of.false_tracks_per_h.value, number(of.nees.map(|it| it.value), 1));
                writeln!(
                    f,
                    "  {:<44} {range:>17} {:>9} {:>9} {:>9} {false_tracks:>8.0} {class:>5} % {nees:>6}",
                    case.name,
                    rmse(0),
                    rmse(1),
                    rmse(2)
                )?;
            }
        }
        writeln!(f, "Errors are root mean squares; intervals are those of 95 %. Without a track, there is no error.")
    }
}

/// Returns a number with this many decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}
