//! `--debug-view`.

use clap::Args;
use limpid::{DebugView, Settings};

#[derive(Debug, Args)]
pub(super) struct DebugViewOptions {
    /// Also shows in colours what limpid finds out about each pixel, with a legend, in the PNG of each frame;
    /// docs/debug-views.md says how to read it.
    #[arg(long, value_name = "NAME", value_parser = names())]
    debug_view: Option<String>,
}

fn names() -> clap::builder::PossibleValuesParser {
    DebugView::ALL.iter().map(|(name, _)| *name).collect::<Vec<_>>().into()
}

impl DebugViewOptions {
    /// Asks for the view that was named.
    pub(super) fn apply(&self, settings: &mut Settings) {
        let named = DebugView::ALL.iter().find(|(name, _)| Some(*name) == self.debug_view.as_deref());
        if let Some((_, view)) = named {
            settings.features.debug_view = Some(*view);
        }
    }
}
