//! The list of the controllers that run on the same samples.

use std::str::FromStr;

use super::exec::NAME as EXEC;
use super::{ControllerChoice, UnknownController};

/// Controllers as they are given to one `--arms`: separated by commas. A command may contain
/// commas, so that `exec:COMMAND` takes the rest of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArmList(pub Vec<ControllerChoice>);

impl FromStr for ArmList {
    type Err = UnknownController;

    fn from_str(text: &str) -> Result<Self, UnknownController> {
        let (mut arms, mut rest) = (Vec::new(), Some(text));
        while let Some(list) = rest {
            let is_process = list.trim_start().split_once(':').is_some_and(|(word, _)| word == EXEC);
            let (first, others) = match list.split_once(',') {
                Some((first, others)) if !is_process => (first, Some(others)),
                _ => (list, None),
            };
            arms.push(first.trim().parse()?);
            rest = others;
        }
        Ok(Self(arms))
    }
}

/// Controllers that cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArmsError {
    /// There is only one.
    #[error("a comparison needs at least two controllers, and `{controller}` is only one")]
    One {
        /// The controller.
        controller: String,
    },
    /// A controller is named twice.
    #[error("`{controller}` is named twice: every arm needs a controller of its own")]
    Twice {
        /// The controller.
        controller: String,
    },
}

impl ArmList {
    /// Returns the controllers of several lists in their order.
    ///
    /// # Errors
    /// [`ArmsError`] if there is only one controller, or one is named twice.
    pub fn joined(lists: &[Self]) -> Result<Vec<ControllerChoice>, ArmsError> {
        let arms: Vec<ControllerChoice> = lists.iter().flat_map(|list| list.0.clone()).collect();
        if let [single] = &arms[..] {
            return Err(ArmsError::One { controller: single.to_string() });
        }
        match arms.iter().enumerate().find(|(index, arm)| arms[..*index].contains(arm)) {
            Some((_, twice)) => Err(ArmsError::Twice { controller: twice.to_string() }),
            None => Ok(arms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_takes_the_rest_of_its_list() {
        let names = |text: &str| {
            let list: ArmList = text.parse().unwrap();
            list.0.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(names("acc, gap-1.6,mis"), ["acc", "gap-1.6", "mis"]);
        assert_eq!(names("acc,exec:python3 a.py 1,2"), ["acc", "exec:python3 a.py 1,2"]);
        for (text, message) in [("acc,,mis", "`` is not a controller"), ("acc,miss", "did you mean `mis`?")] {
            let refused = text.parse::<ArmList>().unwrap_err().to_string();
            assert!(refused.contains(message), "{refused}");
        }
    }

    #[test]
    fn one_controller_or_a_repeated_one_is_refused() {
        let joined =
            |texts: &[&str]| ArmList::joined(&texts.iter().map(|text| text.parse().unwrap()).collect::<Vec<_>>());
        assert_eq!(joined(&["acc,gap-1.6", "mis"]).unwrap().len(), 3);
        assert_eq!(joined(&["mis"]), Err(ArmsError::One { controller: "mis".to_owned() }));
        assert_eq!(joined(&["acc,mis", "acc"]), Err(ArmsError::Twice { controller: "acc".to_owned() }));
    }
}
