//! A sensitivity study as text for the console.

use std::fmt::{self, Display, Formatter};

use closecall_campaign::sensitivity::{
    Decomposition, FactorKind, OutputEffects, OutputIndices, Screening, Sensitivity,
};
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;
use closecall_traffic::statistics::sensitivity::morris::Effects;
use closecall_traffic::statistics::sensitivity::saltelli::MainEffect;

use super::aligned::{error_lines, mean, with_interval, write_rows};

/// Largest number of factors that the table of the screening names for each output.
const LISTED: usize = 12;

/// A study as text.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensitivityText<'a>(pub(super) &'a Sensitivity);

impl Display for SensitivityText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let study = self.0;
        writeln!(
            f,
            "{}: {} factors, controllers {}, seed {}",
            study.scenario,
            study.factors.len(),
            study.controllers.join(" and "),
            study.seed
        )?;
        if let Some(screening) = &study.screening {
            write_screening(f, study, screening)?;
        }
        if let Some(decomposition) = &study.decomposition {
            write_decomposition(f, study, decomposition)?;
        }
        for line in error_lines(&study.errors(), "points") {
            writeln!(f, "{line}")?;
        }
        writeln!(f, "\n{}", conclusion(study))
    }
}

/// Returns the sentence that names the assumption that moves the first output most.
pub(super) fn conclusion(study: &Sensitivity) -> String {
    let Some(output) = study.outputs.first() else { return String::new() };
    let Some(greatest) = study.greatest() else {
        return format!("No assumption was seen to move the {}.", output.title());
    };
    let by = match study.decomposition.as_ref().and_then(|decomposition| decomposition.indices.first()) {
        Some(first) => by_main_effect(study, first, greatest),
        None => "by its elementary effects".to_owned(),
    };
    format!("The assumption that moves the {} most is {}: {by}.", output.title(), study.factors[greatest].name)
}

fn by_main_effect(study: &Sensitivity, output: &OutputIndices, greatest: usize) -> String {
    let effect = |factor: usize| output.main_effects[factor].map(|effect| effect.index);
    let is_other = |factor: &usize| *factor != greatest && study.factors[*factor].kind != FactorKind::Chance;
    let runner_up = output.strongest().into_iter().find(is_other);
    let doubt = match (effect(greatest), runner_up.and_then(|other| Some((other, effect(other)?)))) {
        (Some(greatest_effect), _) if greatest_effect.interval_95[0] <= 0.0 => {
            "; its interval reaches 0, so that chance may explain it".to_owned()
        }
        (Some(greatest_effect), Some((other, next))) if greatest_effect.interval_95[0] <= next.interval_95[1] => {
            format!("; its interval overlaps the interval of {}", study.factors[other].name)
        }
        _ => String::new(),
    };
    let index = with_interval(effect(greatest).map(share_of_variance));
    format!("{} from its lowest to its highest quarter, index {index}{doubt}", from_to(output, greatest))
}

/// Returns an index without the part of its interval that no share of a variance can have.
fn share_of_variance(index: Estimate) -> Estimate {
    index.within([0.0, 1.0])
}

/// Returns the means of an output in the lowest and in the highest quarter of a factor.
pub(super) fn from_to(output: &OutputIndices, factor: usize) -> String {
    let Some(MainEffect { means, .. }) = output.main_effects[factor] else { return "-".to_owned() };
    let mean_text = |quarter: usize| mean(output.output, Some(means[quarter].value));
    format!("{} → {}", mean_text(0), mean_text(means.len() - 1))
}

fn write_screening(f: &mut Formatter<'_>, study: &Sensitivity, screening: &Screening) -> fmt::Result {
    let (trajectories, points) = (screening.trajectories, screening.points);
    writeln!(f, "\nScreening (Morris): {trajectories} trajectories, {points} points")?;
    for OutputEffects { output, of_factors } in &screening.effects {
        let mu_star = |effects: &Effects| effects.mu_star.map_or(0.0, |mu_star| mu_star.value);
        let mut order: Vec<usize> = (0..of_factors.len()).filter(|index| mu_star(&of_factors[*index]) > 0.0).collect();
        order.sort_by(|a, b| mu_star(&of_factors[*b]).total_cmp(&mu_star(&of_factors[*a])).then(a.cmp(b)));
        let hidden = of_factors.len() - order.len().min(LISTED);
        writeln!(f, "\n{}", output.title())?;
        if order.is_empty() {
            writeln!(f, "  no effect of any factor was seen")?;
            continue;
        }
        let mut rows = vec![["factor", "kind", "μ* (95 %)", "μ", "σ"].map(str::to_owned).to_vec()];
        rows.extend(order.into_iter().take(LISTED).map(|index| {
            let (factor, effects) = (&study.factors[index], &of_factors[index]);
            let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
            vec![
                factor.label(),
                factor.kind.name().to_owned(),
                with_interval(effects.mu_star),
                number(effects.mu),
                number(effects.sigma),
            ]
        }));
        write_rows(f, &rows)?;
        if hidden > 0 {
            writeln!(f, "  and {hidden} factors with less or no effect")?;
        }
    }
    Ok(())
}

fn write_decomposition(f: &mut Formatter<'_>, study: &Sensitivity, decomposition: &Decomposition) -> fmt::Result {
    writeln!(f, "\nDecomposition (Sobol'): {} rows, {} points", decomposition.rows, decomposition.points)?;
    for output in &decomposition.indices {
        writeln!(f, "\n{}: mean {}", output.output.title(), mean(output.output, output.mean))?;
        if output.of_groups.iter().all(|indices| indices.total.is_none()) {
            writeln!(f, "  The output does not vary, or changes too seldom: nothing can be said.")?;
            continue;
        }
        let heads = ["what moves the mean", "lowest → highest quarter", "index of the quarters (95 %)"];
        let mut rows = vec![heads.map(str::to_owned).to_vec()];
        rows.extend(output.strongest().into_iter().take(LISTED).map(|factor| {
            let index = output.main_effects[factor].map(|effect| share_of_variance(effect.index));
            vec![study.factors[factor].label(), from_to(output, factor), with_interval(index)]
        }));
        write_rows(f, &rows)?;
        let heads = ["what moves single samples", "total index (95 %)", "first-order index (95 %)"];
        let mut rows = vec![heads.map(str::to_owned).to_vec()];
        rows.extend(output.order().into_iter().map(|group| {
            let indices = &output.of_groups[group];
            vec![decomposition.groups[group].label.clone(), with_interval(indices.total), with_interval(indices.first)]
        }));
        writeln!(f)?;
        write_rows(f, &rows)?;
    }
    Ok(())
}
