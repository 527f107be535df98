//! The assignment of rows to columns with the least total cost, by the Kuhn–Munkres algorithm.
//!
//! The algorithm grows a tree of alternating edges from one row after the other until it reaches a
//! free column, and keeps for each column outside of the tree the least slack of an edge to it (H.
//! W. Kuhn, "The Hungarian method for the assignment problem", 1955; the slacks follow Edmonds and
//! Karp, 1972). It follows the function `kuhn_munkres_min` of the `pathfinding` crate step by step.
//! Of several optima, both therefore choose the same; a test compares them. The crate allocates
//! about ten lists in each call; this implementation keeps its lists.

/// Number of tracks, and of detections, for which memory is reserved. More need more, and no error
/// follows.
pub(crate) const RESERVED: usize = 32;

/// An assignment problem, and the memory of its solution.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assignment {
    columns: usize,
    /// Costs, row by row.
    costs: Vec<i64>,
    /// Column of each row.
    column_of: Vec<Option<usize>>,
    /// Row of each column.
    row_of: Vec<Option<usize>>,
    /// Label of each row: no less than the negative cost of each of its pairs, less the label of
    /// the column.
    row_labels: Vec<i64>,
    column_labels: Vec<i64>,
    /// Rows of the tree.
    reached: Vec<usize>,
    /// For each column of the tree, the row that reached it.
    reached_from: Vec<Option<usize>>,
    /// For each other column, the least slack of an edge from a row of the tree, and that row.
    slacks: Vec<(i64, usize)>,
}

impl Assignment {
    /// Creates a problem without rows, with memory for the usual number of them.
    pub(crate) fn new() -> Self {
        Self {
            columns: 0,
            costs: Vec::with_capacity(2 * RESERVED * RESERVED),
            column_of: Vec::with_capacity(RESERVED),
            row_of: Vec::with_capacity(2 * RESERVED),
            row_labels: Vec::with_capacity(RESERVED),
            column_labels: Vec::with_capacity(2 * RESERVED),
            reached: Vec::with_capacity(RESERVED),
            reached_from: Vec::with_capacity(2 * RESERVED),
            slacks: Vec::with_capacity(2 * RESERVED),
        }
    }

    /// Begins a problem in which all pairs cost the same. There must be at least as many columns as
    /// rows.
    pub(crate) fn begin(&mut self, rows: usize, columns: usize, cost: i64) {
        debug_assert!(rows <= columns, "{rows} rows, {columns} columns");
        self.columns = columns;
        self.costs.clear();
        self.costs.resize(rows * columns, cost);
        self.column_of.clear();
        self.column_of.resize(rows, None);
        self.row_of.clear();
        self.row_of.resize(columns, None);
        self.column_labels.clear();
        self.column_labels.resize(columns, 0);
    }

    /// Returns the cost of a pair.
    pub(crate) fn cost(&self, row: usize, column: usize) -> i64 {
        self.costs[row * self.columns + column]
    }

    /// Sets the cost of a pair.
    pub(crate) fn set_cost(&mut self, row: usize, column: usize, cost: i64) {
        self.costs[row * self.columns + column] = cost;
    }

    /// Returns the column of each row in the solution with the least total cost.
    pub(crate) fn solve(&mut self) -> &[Option<usize>] {
        self.row_labels.clear();
        let largest = |costs: &[i64]| costs.iter().map(|cost| -cost).max().unwrap_or(0);
        self.row_labels.extend(self.costs.chunks_exact(self.columns.max(1)).map(largest));
        for root in 0..self.row_labels.len() {
            let free = self.reach_free_column(root);
            self.invert_path_to(free);
        }
        &self.column_of
    }

    /// Returns the slack of a pair: how much its labels exceed its negative cost.
    fn slack(&self, row: usize, column: usize) -> i64 {
        self.row_labels[row] + self.column_labels[column] + self.cost(row, column)
    }

    /// Grows the tree from the row `root` until it reaches a column without a row, and returns this
    /// column.
    fn reach_free_column(&mut self, root: usize) -> usize {
        self.reached.clear();
        self.reached.push(root);
        self.reached_from.clear();
        self.reached_from.resize(self.columns, None);
        self.slacks.clear();
        for column in 0..self.columns {
            self.slacks.push((self.slack(root, column), root));
        }
        loop {
            let (mut least, mut row, mut column) = (i64::MAX, 0, 0);
            for (other, &(slack, from)) in self.slacks.iter().enumerate() {
                if self.reached_from[other].is_none() && slack < least {
                    (least, row, column) = (slack, from, other);
                }
            }
            if least > 0 {
                self.shift_labels(least);
            }
            self.reached_from[column] = Some(row);
            let Some(row) = self.row_of[column] else { return column };
            self.reached.push(row);
            for column in 0..self.columns {
                if self.reached_from[column].is_none() {
                    let slack = self.slack(row, column);
                    if self.slacks[column].0 > slack {
                        self.slacks[column] = (slack, row);
                    }
                }
            }
        }
    }

    /// Shifts the labels of the tree such that an edge with the slack `least` has none.
    fn shift_labels(&mut self, least: i64) {
        for &row in &self.reached {
            self.row_labels[row] -= least;
        }
        for column in 0..self.columns {
            if self.reached_from[column].is_some() {
                self.column_labels[column] += least;
            } else {
                self.slacks[column].0 -= least;
            }
        }
    }

    /// Assigns the columns on the path of the tree to `column` to the rows through which they were
    /// reached.
    fn invert_path_to(&mut self, column: usize) {
        let mut next = Some(column);
        while let Some(column) = next {
            let Some(row) = self.reached_from[column] else { return };
            self.row_of[column] = Some(row);
            next = self.column_of[row].replace(column);
        }
    }
}

#[cfg(test)]
mod tests {
    use pathfinding::prelude::{Matrix, kuhn_munkres_min};
    use proptest::prelude::*;

    use super::*;

    /// Returns the costs of a problem: row by row, with no fewer columns than rows. A small range
    /// of costs gives ties.
    fn costs() -> impl Strategy<Value = Vec<Vec<i64>>> {
        (1..7_usize, 0..5_usize, 1..60_i64).prop_flat_map(|(rows, more, range)| {
            prop::collection::vec(prop::collection::vec(-range..range, rows + more), rows)
        })
    }

    proptest! {
        #[test]
        fn of_several_optima_the_algorithm_chooses_the_same_as_the_library(
            problems in prop::collection::vec(costs(), 1..4),
        ) {
            // One memory for all problems: the remains of an earlier problem must not matter.
            let mut assignment = Assignment::new();
            for costs in problems {
                assignment.begin(costs.len(), costs[0].len(), 0);
                for (row, of_row) in costs.iter().enumerate() {
                    for (column, cost) in of_row.iter().enumerate() {
                        assignment.set_cost(row, column, *cost);
                    }
                }
                let (_, expected) = kuhn_munkres_min(&Matrix::from_rows(costs).unwrap());
                let expected: Vec<_> = expected.into_iter().map(Some).collect();
                prop_assert_eq!(assignment.solve(), &expected[..]);
            }
        }
    }
}
