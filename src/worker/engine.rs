//! The choice between the processor and a graphics card for pictures.

use std::sync::Arc;

use crate::render::Engine;
use crate::render::tracer::{Processor, Tracer};

/// What traces the paths of pictures.
pub struct Chosen {
    /// The device.
    pub tracer: Arc<dyn Tracer>,
    /// Why it is the processor though a card was allowed or asked for.
    pub reason: Option<String>,
}

/// The tracer of an engine. A card is found once in a process, which can take seconds.
pub fn tracer(engine: Engine) -> Chosen {
    let processor = || -> Arc<dyn Tracer> { Arc::new(Processor) };
    match engine {
        Engine::Processor => Chosen { tracer: processor(), reason: None },
        Engine::Auto | Engine::Card => match card() {
            Ok(tracer) => Chosen { tracer, reason: None },
            Err(reason) => Chosen { tracer: processor(), reason: Some(reason) },
        },
    }
}

#[cfg(feature = "gpu")]
fn card() -> Result<Arc<dyn Tracer>, String> {
    use std::sync::OnceLock;

    use crate::gpu::{Adapters, Card};

    static CARD: OnceLock<Result<Arc<Card>, String>> = OnceLock::new();
    let found = || Card::find(Adapters::Cards).map(Arc::new).map_err(|error| error.to_string());
    CARD.get_or_init(found).clone().map(|card| card as Arc<dyn Tracer>)
}

#[cfg(not(feature = "gpu"))]
fn card() -> Result<Arc<dyn Tracer>, String> {
    Err("this program was built without the feature gpu".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_traces_for_a_reason_or_because_it_was_asked_to() {
        for engine in [Engine::Auto, Engine::Card] {
            let Chosen { tracer, reason } = tracer(engine);
            assert_eq!(reason.is_some(), tracer.name() == Processor.name(), "{reason:?}");
        }
        let Chosen { tracer, reason } = tracer(Engine::Processor);
        assert_eq!((tracer.name(), reason), (Processor.name(), None));
    }
}
