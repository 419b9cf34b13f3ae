//! What a panel is given in every frame.

use crate::app::actions::Action;
use crate::app::jobs::Jobs;
use crate::app::messages::Messages;
use crate::app::project::Project;
use crate::app::viewport::Viewport;

/// What a panel shows, and where it puts what the user wants done.
pub struct Context<'a> {
    pub project: &'a Project,
    pub viewport: &'a mut Viewport,
    pub messages: &'a Messages,
    pub jobs: &'a Jobs,
    pub actions: &'a mut Vec<Action>,
}
