//! Fitted distributions as a table for human readers.

use std::fmt;

use closecall_recorded::fit::FittedDistributions;

/// The quantities with their number of values, median, and the goodness of fit of their parametric
/// form.
#[derive(Clone, Copy, Debug)]
pub struct FitText<'a>(pub &'a FittedDistributions);

impl fmt::Display for FitText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for quantity in &self.0.fitted {
            write!(f, "{:<24} n = {:>4}, median {:.3}", quantity.quantity.name(), quantity.n, quantity.median)?;
            match quantity.form {
                Some((form, fit)) => {
                    let (name, distance, p) = (form.name(), fit.distance, fit.p_value);
                    writeln!(f, "; {name}: Kolmogorov-Smirnov distance {distance:.3}, p = {p:.3}")?;
                }
                None => writeln!(f, "; no parametric form suits these values")?,
            }
        }
        for correlation in &self.0.correlations {
            let (quantity, with) = (correlation.of.name(), correlation.with.name());
            writeln!(
                f,
                "{quantity:<24} with {with}: rank correlation {:.2}, n = {}",
                correlation.spearman, correlation.n
            )?;
        }
        for (quantity, n) in &self.0.too_few {
            writeln!(f, "{:<24} n = {n:>4}, too few to fit", quantity.name())?;
        }
        Ok(())
    }
}
