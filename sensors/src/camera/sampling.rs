//! The columns and rows of the image that a network reads.
//!
//! A network need not read every pixel. Distant objects are small and lie near the horizon, and
//! near objects are large. A few pixels therefore carry as much information as all pixels. Other
//! pixels need not be rendered.

use super::picture::{HEIGHT_PX, Resolution, WIDTH_PX};

/// The columns and rows of the image that a network reads, in ascending order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sampling {
    columns: Vec<i32>,
    rows: Vec<i32>,
}

/// The reason why columns or rows cannot be sampled.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the {axis} {text:?} are not {wanted}")]
pub struct SamplingError {
    axis: &'static str,
    text: String,
    wanted: String,
}

impl Sampling {
    /// Returns every pixel of the usual image.
    pub fn all() -> Self {
        Self { columns: (0..i32::from(WIDTH_PX)).collect(), rows: (0..i32::from(HEIGHT_PX)).collect() }
    }

    /// Returns every `step`-th column and row of an image of this size.
    pub fn every(step: u8, image: Resolution) -> Self {
        let every = |size: u16| (0..i32::from(size)).step_by(usize::from(step.max(1))).collect();
        Self { columns: every(image.width_px), rows: every(image.height_px) }
    }

    /// Reads columns and rows from whole numbers, separated by blanks.
    ///
    /// # Errors
    /// [`SamplingError`] if the numbers do not ascend, or lie outside of the usual image.
    pub fn parse(columns: &str, rows: &str) -> Result<Self, SamplingError> {
        let read = |axis, text: &str, limit: u16| {
            let numbers: Option<Vec<i32>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
            let is_right = |numbers: &Vec<i32>| {
                numbers.first().is_some_and(|first| *first >= 0)
                    && numbers.last().is_some_and(|last| *last < i32::from(limit))
                    && numbers.is_sorted_by(|one, next| one < next)
            };
            numbers.filter(is_right).ok_or_else(|| SamplingError {
                axis,
                text: text.chars().take(80).collect(),
                wanted: format!("ascending whole numbers from 0 to {}", limit - 1),
            })
        };
        Ok(Self { columns: read("columns", columns, WIDTH_PX)?, rows: read("rows", rows, HEIGHT_PX)? })
    }

    /// Returns the columns.
    pub fn columns(&self) -> &[i32] {
        &self.columns
    }

    /// Returns the rows.
    pub fn rows(&self) -> &[i32] {
        &self.rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_a_part_of_all() {
        assert_eq!(Sampling::every(1, Resolution::USUAL), Sampling::all());
        let second = Sampling::every(2, Resolution::USUAL);
        assert_eq!((second.columns().len(), second.rows().len(), second.columns()[3]), (640, 400, 6));
        let odd = Sampling::every(3, Resolution { width_px: 641, height_px: 480 });
        assert_eq!((odd.columns().len(), odd.rows().len(), odd.columns().last()), (214, 160, Some(&639)));
    }

    #[test]
    fn columns_and_rows_ascend_within_the_image() {
        let sampling = Sampling::parse("0 5 1279", "3\n799").unwrap();
        assert_eq!((sampling.columns(), sampling.rows()), (&[0, 5, 1279][..], &[3, 799][..]));
        for (columns, rows) in
            [("", "1"), ("1 1", "1"), ("2 1", "1"), ("-1", "1"), ("1280", "1"), ("1", "800"), ("x", "1")]
        {
            let error = Sampling::parse(columns, rows).unwrap_err().to_string();
            assert!(error.contains("are not ascending whole numbers from 0 to"), "{error}");
        }
    }
}
