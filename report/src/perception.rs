//! A study as text, as JSON, as Parquet, and as a page with charts. With a second study, the page
//! and the text compare the two.

use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};

use crate::json::stamped;
use crate::table::{Column, write_columns};
use closecall_traffic::atomic::{WriteError, create_folder, write_file};
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use closecall_studies::perception::figures::{CalibrationBin, CurvePoint, Estimate, Figures, PointErrors};
use closecall_studies::perception::study::Study;

mod chart;
mod page;
mod recorded;

pub use recorded::RecordedReport;

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

    /// Writes `sensors.json`, `sensors.parquet`, `curves.parquet`, `calibration.parquet` and
    /// `sensors.html` into a folder, which is created if it does not exist. Returns their paths.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be written. An existing file then stays as it is.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, WriteError> {
        create_folder(folder)?;
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
        let rows =
            || self.0.iter().flat_map(|study| study.cases.iter().map(move |(case, figures)| (study, case, figures)));
        let number = |figure: &dyn Fn(&Figures) -> Option<f64>| {
            Column::Number(rows().map(|(_, _, figures)| figure(figures)).collect())
        };
        let value = |figure: fn(&Figures) -> Option<Estimate>| {
            number(&|estimate| figure(estimate).map(|estimate| estimate.value))
        };
        let low = |figure: fn(&Figures) -> Option<Estimate>| {
            number(&|estimate| figure(estimate).map(|estimate| estimate.interval_95[0]))
        };
        let high = |figure: fn(&Figures) -> Option<Estimate>| {
            number(&|estimate| figure(estimate).map(|estimate| estimate.interval_95[1]))
        };
        let mut columns = vec![
            ("configuration", "", Column::Text(rows().map(|(study, _, _)| study.name.clone()).collect())),
            ("sensors", "", Column::Text(rows().map(|(study, _, _)| study.mode.name().to_owned()).collect())),
            ("seed", "", Column::Number(rows().map(|(study, _, _)| Some(study.seed as f64)).collect())),
            ("approaches", "", Column::Number(rows().map(|(study, _, _)| Some(study.runs as f64)).collect())),
            ("factor", "", Column::Text(rows().map(|(_, case, _)| case.factor.to_owned()).collect())),
            ("case", "", Column::Text(rows().map(|(_, case, _)| case.name.clone()).collect())),
        ];
        for (names, unit, figure) in FIGURES {
            columns.push((names[0], unit, value(figure)));
            columns.push((names[1], unit, low(figure)));
            columns.push((names[2], unit, high(figure)));
        }
        for (name, unit, figure) in PLAIN {
            columns.push((name, unit, number(&figure)));
        }
        columns
    }

    fn curve_columns(&self) -> Vec<(&'static str, &'static str, Column)> {
        let rows: Vec<(&Study, &str, &CurvePoint)> =
            self.0
                .iter()
                .flat_map(|study| {
                    study.cases.iter().flat_map(move |(case, figures)| {
                        figures.curve.iter().map(move |point| (study, &*case.name, point))
                    })
                })
                .collect();
        let number =
            |value: &dyn Fn(&CurvePoint) -> Option<f64>| Column::Number(rows.iter().map(|row| value(row.2)).collect());
        let mut columns = vec![
            ("configuration", "", Column::Text(rows.iter().map(|row| row.0.name.clone()).collect())),
            ("case", "", Column::Text(rows.iter().map(|row| row.1.to_owned()).collect())),
            ("gap_m", "m", number(&|point| Some(point.gap_m))),
            ("confirmed", "", number(&|point| Some(point.confirmed.value))),
            ("confirmed_low_95", "", number(&|point| Some(point.confirmed.interval_95[0]))),
            ("confirmed_high_95", "", number(&|point| Some(point.confirmed.interval_95[1]))),
        ];
        for (names, unit, index) in CURVE_ERRORS {
            let error =
                |error: fn(&PointErrors) -> f64| number(&|point| point.errors.map(|errors| error(&errors[index])));
            columns.push((names[0], unit, error(|errors| errors.bias)));
            columns.push((names[1], unit, error(|errors| errors.rmse)));
            columns.push((names[2], unit, error(|errors| errors.q95)));
        }
        columns
    }

    fn calibration_columns(&self) -> Vec<(&'static str, &'static str, Column)> {
        let rows: Vec<(&Study, &str, &CalibrationBin)> = self
            .0
            .iter()
            .flat_map(|study| {
                study.cases.iter().flat_map(move |(case, figures)| {
                    figures.calibration.iter().map(move |bin| (study, &*case.name, bin))
                })
            })
            .collect();
        let number =
            |value: fn(&CalibrationBin) -> f64| Column::Number(rows.iter().map(|row| Some(value(row.2))).collect());
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
    (["range_m", "range_low_95_m", "range_high_95_m"], "m", |figures| Some(figures.range_m)),
    (["along_bias_m", "along_bias_low_95_m", "along_bias_high_95_m"], "m", |figures| {
        figures.errors.map(|errors| errors[0].bias)
    }),
    (["along_rmse_m", "along_rmse_low_95_m", "along_rmse_high_95_m"], "m", |figures| {
        figures.errors.map(|errors| errors[0].rmse)
    }),
    (["across_bias_m", "across_bias_low_95_m", "across_bias_high_95_m"], "m", |figures| {
        figures.errors.map(|errors| errors[1].bias)
    }),
    (["across_rmse_m", "across_rmse_low_95_m", "across_rmse_high_95_m"], "m", |figures| {
        figures.errors.map(|errors| errors[1].rmse)
    }),
    (["speed_bias_mps", "speed_bias_low_95_mps", "speed_bias_high_95_mps"], "m/s", |figures| {
        figures.errors.map(|errors| errors[2].bias)
    }),
    (["speed_rmse_mps", "speed_rmse_low_95_mps", "speed_rmse_high_95_mps"], "m/s", |figures| {
        figures.errors.map(|errors| errors[2].rmse)
    }),
    (["confirmed_after_s", "confirmed_after_low_95_s", "confirmed_after_high_95_s"], "s", |figures| {
        figures.confirmed_after_s
    }),
    (["confirms", "confirms_low_95", "confirms_high_95"], "", |figures| Some(figures.confirms)),
    (["false_tracks_per_h", "false_tracks_low_95_per_h", "false_tracks_high_95_per_h"], "1/h", |figures| {
        Some(figures.false_tracks_per_h)
    }),
    (["id_switches", "id_switches_low_95", "id_switches_high_95"], "", |figures| Some(figures.id_switches)),
    (["unavailable", "unavailable_low_95", "unavailable_high_95"], "", |figures| Some(figures.unavailable)),
    (["gospa_m", "gospa_low_95_m", "gospa_high_95_m"], "m", |figures| Some(figures.gospa_m)),
    (["class_accuracy", "class_accuracy_low_95", "class_accuracy_high_95"], "", |figures| figures.class_accuracy),
    (["nees", "nees_low_95", "nees_high_95"], "", |figures| figures.nees),
];

/// The figures without intervals: name, unit, and the figure.
type Plain = (&'static str, &'static str, fn(&Figures) -> Option<f64>);

const PLAIN: [Plain; 4] = [
    ("along_q95_m", "m", |figures| figures.errors.map(|errors| errors[0].q95)),
    ("across_q95_m", "m", |figures| figures.errors.map(|errors| errors[1].q95)),
    ("speed_q95_mps", "m/s", |figures| figures.errors.map(|errors| errors[2].q95)),
    ("calibration_error", "", |figures| figures.calibration_error),
];

/// The errors of a curve: names of bias, root mean square and 95 % quantile of the magnitude, unit,
/// and index.
const CURVE_ERRORS: [([&str; 3], &str, usize); 3] = [
    (["along_bias_m", "along_rmse_m", "along_q95_m"], "m", 0),
    (["across_bias_m", "across_rmse_m", "across_q95_m"], "m", 1),
    (["speed_bias_mps", "speed_rmse_mps", "speed_q95_mps"], "m/s", 2),
];

/// Returns the JSON of a value with its interval; a bound that does not exist is `null`.
fn estimate(estimate: &Estimate) -> Value {
    json!({ "value": estimate.value, "low_95": estimate.interval_95[0], "high_95": estimate.interval_95[1] })
}

fn study_json(study: &Study) -> Value {
    let errors = |figures: &Figures| {
        figures.errors.map(|errors| {
            let each = |error: &closecall_studies::perception::figures::ErrorFigures| {
                json!({ "bias": estimate(&error.bias), "rmse": estimate(&error.rmse), "q95": error.q95 })
            };
            json!({ "along_m": each(&errors[0]), "across_m": each(&errors[1]), "speed_mps": each(&errors[2]) })
        })
    };
    let point = |curve_point: &CurvePoint| {
        let mut point = json!({ "gap_m": curve_point.gap_m, "confirmed": estimate(&curve_point.confirmed) });
        for (names, _, index) in CURVE_ERRORS {
            let errors = curve_point.errors.map(|errors| errors[index]);
            point[names[0]] = json!(errors.map(|errors| errors.bias));
            point[names[1]] = json!(errors.map(|errors| errors.rmse));
            point[names[2]] = json!(errors.map(|errors| errors.q95));
        }
        point
    };
    let cases: Vec<Value> = study
        .cases
        .iter()
        .map(|(case, figures)| {
            json!({
                "factor": case.factor, "case": case.name, "range_m": estimate(&figures.range_m), "errors": errors(figures),
                "confirmed_after_s": figures.confirmed_after_s.as_ref().map(estimate), "confirms": estimate(&figures.confirms),
                "false_tracks_per_h": estimate(&figures.false_tracks_per_h), "id_switches": estimate(&figures.id_switches),
                "unavailable": estimate(&figures.unavailable), "gospa_m": estimate(&figures.gospa_m), "class_accuracy": figures.class_accuracy.as_ref().map(estimate),
                "calibration_error": figures.calibration_error, "nees": figures.nees.as_ref().map(estimate),
                "calibration": figures.calibration.iter().map(|bin| json!({
                    "confidence": bin.confidence, "accuracy": bin.accuracy, "steps": bin.steps,
                })).collect::<Vec<_>>(),
                "curve": figures.curve.iter().map(point).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({ "configuration": study.name, "sensors": study.mode.name(), "approaches": study.runs, "cases": cases })
}

impl Display for Studies {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for study in &self.0 {
            let Study { name, mode, runs, seed, .. } = study;
            writeln!(
                f,
                "sensors of {name}, mode {}: {} of each case, seed {seed}",
                mode.name(),
                counted(*runs, "approach")
            )?;
            writeln!(
                f,
                "  {:<44} {:>17} {:>9} {:>9} {:>9} {:>8} {:>7} {:>6}",
                "case", "first track (m)", "along (m)", "across (m)", "v (m/s)", "false/h", "class", "NEES"
            )?;
            for (case, figures) in &study.cases {
                let [low, high] = figures.range_m.interval_95;
                let range = format!("{:.0} ({low:.0} to {high:.0})", figures.range_m.value);
                let rmse = |index: usize| number(figures.errors.map(|errors| errors[index].rmse.value), 2);
                let class = number(figures.class_accuracy.map(|estimate| 100.0 * estimate.value), 0);
                let (false_tracks, nees) =
                    (figures.false_tracks_per_h.value, number(figures.nees.map(|estimate| estimate.value), 1));
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
        writeln!(f, "Errors are root mean squares; intervals have 95 % confidence. Without a track, there is no error.")
    }
}

/// Returns a number with this many decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}
