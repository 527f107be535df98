//! Scenarios and controllers that cannot form a campaign.

use std::path::PathBuf;

use closecall_scenarios::source::same_name;
use closecall_simulation::controller::native::NativeError;

/// The reason for which scenarios cannot form a campaign.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// Two scenarios have the same name, by which results are filed.
    #[error("{}", same_name(first, second, name))]
    SameName {
        /// One file.
        first: PathBuf,
        /// The other file.
        second: PathBuf,
        /// The name of both.
        name: String,
    },
    /// The sampling design `coverage` has no bins to visit.
    #[error(
        "{scenario}: the design `coverage` visits the bins that `[coverage]` names under `fill`, and the scenario names none that can be hit"
    )]
    NothingToFill {
        /// The scenario.
        scenario: String,
    },
    /// A controller does not fit a scenario.
    #[error("{scenario}: {source}")]
    Controller {
        /// The scenario.
        scenario: String,
        /// What is wrong.
        source: NativeError,
    },
    /// A margin increase system is to drive an ego stack that has none.
    #[error(
        "{scenario}: `{controller}` needs a margin increase system, and the ego stack has none: add `mis` to its `ego-stack`, or name another controller"
    )]
    WithoutMis {
        /// The scenario.
        scenario: String,
        /// The controller.
        controller: String,
    },
    /// A human is to drive an ego that has no human driver.
    #[error(
        "{scenario}: `{controller}` needs a human driver of the ego, and the ego stack has none: add `human` to its `ego-stack`, as in `human = {{ wiedemann99 = {{}} }}`, or name another controller"
    )]
    WithoutHuman {
        /// The scenario.
        scenario: String,
        /// The controller.
        controller: String,
    },
    /// Two arms have the same functions with the same settings.
    #[error(
        "{scenario}: `{first}` and `{second}` are the same stack in this scenario: switch a function off or on, as in `acc-aeb` and `acc+aeb`"
    )]
    SameStack {
        /// The scenario.
        scenario: String,
        /// The first arm.
        first: String,
        /// The second arm.
        second: String,
    },
    /// The settings of an arm change nothing.
    #[error(
        "{scenario}: the settings of `{controller}` change nothing: its stack lacks the function, or has these values already"
    )]
    NoEffect {
        /// The scenario.
        scenario: String,
        /// The arm.
        controller: String,
    },
    /// Two arms have the same controller, so that they would have the same outcomes.
    #[error("`{controller}` is named twice: every arm needs a controller of its own")]
    SameArm {
        /// The controller.
        controller: String,
    },
}
