//! The tornado charts of a sensitivity study.

use std::io;

use closecall_campaign::sensitivity::{
    Decomposition, FactorKind, OutputEffects, OutputIndices, Screening, Sensitivity,
};

use super::sensitivity::from_to;
use crate::charts::{TornadoBar, tornado};

/// Largest number of bars in a chart.
const BARS: usize = 14;

/// Returns the charts of a study, with the name of the output of each: of the decomposition if there is one.
pub(super) fn charts(study: &Sensitivity) -> io::Result<Vec<(&'static str, String)>> {
    let chart = |output: &OutputIndices, found| Ok((output.output.name(), of_indices(study, found, output)?));
    if let Some(found) = &study.decomposition {
        return found.indices.iter().map(|output| chart(output, found)).collect();
    }
    let effects = |screening: &Screening| {
        screening.effects.iter().map(|output| Ok((output.output.name(), of_effects(study, output)?))).collect()
    };
    study.screening.as_ref().map_or_else(|| Ok(Vec::new()), effects)
}

fn of_indices(study: &Sensitivity, found: &Decomposition, output: &OutputIndices) -> io::Result<String> {
    let bar = |group: usize| {
        let (of_group, indices) = (&found.groups[group], &output.of_groups[group]);
        let total = indices.total?;
        let is_grey = !matches!(of_group.factors[..], [one] if study.factors[one].kind != FactorKind::Chance);
        Some(TornadoBar {
            label: of_group.label.clone(),
            value: total.value,
            interval_95: total.interval_95,
            inner: Some(indices.first.map_or(0.0, |first| first.value)),
            note: from_to(output, group),
            is_grey,
        })
    };
    let bars: Vec<TornadoBar> = output.order().into_iter().filter_map(bar).take(BARS).collect();
    let heads = ["factor", output.output.title(), "lowest → highest quarter"];
    let name = "share of the variance: total index with its 95 % interval; dark: first order";
    tornado(&bars, heads, name)
}

fn of_effects(study: &Sensitivity, output: &OutputEffects) -> io::Result<String> {
    let mut bars: Vec<TornadoBar> = study
        .factors
        .iter()
        .zip(&output.of_factors)
        .filter_map(|(factor, effects)| {
            let mu_star = effects.mu_star.filter(|mu_star| mu_star.value > 0.0)?;
            Some(TornadoBar {
                label: factor.label(),
                value: mu_star.value,
                interval_95: mu_star.interval_95,
                inner: None,
                note: format!("σ {:.2}", effects.sigma.unwrap_or(0.0)),
                is_grey: factor.kind == FactorKind::Chance,
            })
        })
        .collect();
    bars.sort_by(|a, b| b.value.total_cmp(&a.value));
    bars.truncate(BARS);
    let name = "mean magnitude of the elementary effects, μ*, with its 95 % interval";
    tornado(&bars, ["factor", output.output.title(), "interactions"], name)
}
