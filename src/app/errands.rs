//! Short work with the disk, done on threads so that no frame waits for a slow drive.

use super::actions::{Action, Outcome};
use super::pending::{Answer, Pending};
use super::state::State;

/// Has something done on a thread; what it comes to is done in a later frame.
pub fn start(state: &mut State, work: impl FnOnce() -> Vec<Outcome> + Send + 'static) {
    state.errands.push_back(Pending::start("errand", &state.ctx, work));
}

/// Takes what has been done, in the order in which it was asked for.
pub fn follow(state: &mut State, actions: &mut Vec<Action>) {
    while let Some(errand) = state.errands.front() {
        let outcomes = match errand.answer() {
            Answer::Waiting => return,
            Answer::Ready(outcomes) => outcomes,
            Answer::Lost => {
                let text = "Reading or writing it failed; the log has more.".to_owned();
                vec![Outcome::Error("This cannot be done", text)]
            }
        };
        state.errands.pop_front();
        for outcome in outcomes {
            match outcome {
                Outcome::Do(action) => actions.push(action),
                Outcome::AskToReplace(asked, path) => state.dialogs.replace = Some((asked, path)),
                Outcome::Notice(text) => state.messages.notice(text),
                Outcome::Error(headline, text) => state.messages.error(headline, text),
            }
        }
    }
}
