//! The tornado charts of a sensitivity study.

use std::io;

use closecall_campaign::sensitivity::{Factor, FactorKind, OutputEffects, OutputIndices, Screening, Sensitivity};
use closecall_traffic::statistics::sensitivity::morris::Effects;

use super::sensitivity::from_to;
use crate::charts::{TornadoBar, TornadoTexts, tornado};

/// Largest number of bars in a chart.
const BARS: usize = 14;

/// Returns the charts of a study, with the name of the output of each: of the decomposition if
/// there is one.
pub(super) fn charts(study: &Sensitivity) -> io::Result<Vec<(&'static str, String)>> {
    let chart = |output: &OutputIndices| Ok((output.output.name(), chart_of_effects_on_mean(study, output)?));
    if let Some(decomposition) = &study.decomposition {
        return decomposition.indices.iter().map(chart).collect();
    }
    let effects = |screening: &Screening| {
        screening.effects.iter().map(|output| Ok((output.output.name(), chart_of_effects(study, output)?))).collect()
    };
    study.screening.as_ref().map_or_else(|| Ok(Vec::new()), effects)
}

fn chart_of_effects_on_mean(study: &Sensitivity, output: &OutputIndices) -> io::Result<String> {
    // Events are shown in percent.
    let unit = if output.output.is_event() { 100.0 } else { 1.0 };
    let bar = |factor: usize| {
        let (effect, of_factor) = (output.main_effects[factor]?, &study.factors[factor]);
        let ends = effect.ends();
        Some(TornadoBar {
            label: of_factor.label(),
            ends: ends.map(|end| unit * end.value),
            intervals_95: ends.map(|end| end.interval_95.map(|bound| unit * bound)),
            note: from_to(output, factor),
            is_grey: of_factor.kind == FactorKind::Chance || effect.index.interval_95[0] <= 0.0,
        })
    };
    let bars: Vec<TornadoBar> = output.strongest().into_iter().filter_map(bar).take(BARS).collect();
    let heads = ["factor", output.output.title(), "lowest → highest quarter"];
    let scale = if output.output.is_event() { "[% of the samples]" } else { "mean" };
    tornado(&bars, unit * output.mean.unwrap_or(0.0), TornadoTexts { heads, scale })
}

fn chart_of_effects(study: &Sensitivity, output: &OutputEffects) -> io::Result<String> {
    let bar = |(factor, effects): (&Factor, &Effects)| {
        let mu_star = effects.mu_star.filter(|mu_star| mu_star.value > 0.0)?;
        Some(TornadoBar {
            label: factor.label(),
            ends: [0.0, mu_star.value],
            intervals_95: [[0.0; 2], mu_star.interval_95],
            note: format!("σ {:.2}", effects.sigma.unwrap_or(0.0)),
            is_grey: factor.kind == FactorKind::Chance,
        })
    };
    let mut bars: Vec<TornadoBar> = study.factors.iter().zip(&output.of_factors).filter_map(bar).collect();
    bars.sort_by(|a, b| b.ends[1].total_cmp(&a.ends[1]));
    bars.truncate(BARS);
    let heads = ["factor", output.output.title(), "interactions"];
    tornado(&bars, 0.0, TornadoTexts { heads, scale: "mean magnitude of the elementary effects, μ*" })
}
