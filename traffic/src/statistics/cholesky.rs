//! The Cholesky factor of a correlation matrix.

/// Returns the rows of the lower Cholesky factor, or `None` if the matrix is not positive definite.
pub fn cholesky(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    /// Smallest square on the diagonal: below it, a parameter follows from the others but for
    /// rounding.
    const SMALLEST: f64 = 1e-9;
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(matrix.len());
    for (i, given) in matrix.iter().enumerate() {
        let mut row = vec![0.0; matrix.len()];
        for j in 0..i {
            let explained: f64 = (0..j).map(|k| row[k] * rows[j][k]).sum();
            row[j] = (given[j] - explained) / rows[j][j];
        }
        let square = given[i] - row[..i].iter().map(|x| x * x).sum::<f64>();
        if !(square > SMALLEST) {
            return None;
        }
        row[i] = square.sqrt();
        rows.push(row);
    }
    Some(rows)
}
