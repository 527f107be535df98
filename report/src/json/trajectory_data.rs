//! Results from trajectory data as JSON.

use closecall_recorded::fit::{FittedDistributions, FittedQuantity, Quantity, RankCorrelation};
use closecall_recorded::lane_change::{LaneChange, Score};
use closecall_recorded::robustness::Robustness;
use closecall_recorded::trajectory_data::{QualityInspector, Tracks};
use serde_json::{Value, json};

/// Returns the flaws of a trajectory file. `inspector` has read all of `tracks`.
pub fn quality(tracks: &Tracks<'_>, inspector: &QualityInspector) -> Value {
    let quality = inspector.count_flaws();
    let span = inspector.span();
    json!({
        "name": tracks.name(),
        "layout": tracks.layout(),
        "period_s": tracks.period().s(),
        "rows": tracks.rows(),
        "tracks": quality.tracks,
        "vehicles": quality.vehicles,
        "instants": quality.instants,
        "first_s": span.map(|(first, _)| first.s()),
        "last_s": span.map(|(_, last)| last.s()),
        "lane_width_m": tracks.markings().typical_lane_width_m(),
        "ignored_markings": tracks.markings().ignored(),
        "unknown_classes": tracks.unknown_classes(),
        "continuity": tracks.continuity(),
        "warnings": tracks.warnings(),
        "flaws": inspector.flaws(),
        "overlaps_unchecked_instants": inspector.unchecked_points(),
        "dropped": tracks.dropped(),
        "usable": tracks.dropped().count() == 0,
    })
}

/// Returns lane changes; with a score, an object with both.
pub fn lane_changes(changes: &[LaneChange], score: Option<&Score>) -> Value {
    score.map_or_else(|| json!(changes), |score| json!({ "lane_changes": changes, "score": score }))
}

/// Returns the results of a robustness study, with the lowest level of noise at which each
/// criterion fails.
pub fn robustness(study: &Robustness) -> Value {
    let fails = study.criteria.iter().enumerate();
    let fails =
        fails.map(|(column, criterion)| (criterion.name().to_owned(), study.failing_noise_m_per_sqrt_s(column).into()));
    let by_draw = study.criteria.iter().enumerate();
    let by_draw = by_draw
        .map(|(column, criterion)| (criterion.name().to_owned(), study.failing_noise_by_repetition(column).into()));
    let mut value = json!(study);
    value["noise_draws"] = value["noise"].take();
    value["noise"] = json!(study.mean_noise());
    value["fails_from_noise_by_draw"] = Value::Object(by_draw.collect());
    value["fails_from_noise_m_per_sqrt_s"] = Value::Object(fails.collect());
    value
}

/// Returns the median and the quantiles of each fitted quantity, and the quantities with too few
/// values to fit.
pub fn fitted(fitted: &FittedDistributions) -> Value {
    let quantity = |quantity: &FittedQuantity| {
        json!({
            "name": quantity.quantity.name(),
            "n": quantity.n,
            "median": quantity.median,
            "interval_95": quantity.interval_95,
            "quantiles": quantity.quantiles,
            "goodness_of_fit": quantity.form.map(|(form, fit)| {
                json!({ "form": form.name(), "distance": fit.distance, "p_value": fit.p_value })
            }),
        })
    };
    let correlation = |correlation: &RankCorrelation| json!({ "of": correlation.of.name(), "with": correlation.with.name(), "n": correlation.n, "spearman": correlation.spearman });
    let too_few = |(quantity, n): &(Quantity, usize)| json!({ "name": quantity.name(), "n": n });
    json!({
        "trajectory_data": fitted.data_sets.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "seed": fitted.seed,
        "fitted": fitted.fitted.iter().map(quantity).collect::<Vec<_>>(),
        "correlations": fitted.correlations.iter().map(correlation).collect::<Vec<_>>(),
        "too_few": fitted.too_few.iter().map(too_few).collect::<Vec<_>>(),
    })
}
