//! Barriers of any plan cover every hazard and nothing else.

use glam::UVec2;
use limpid::plan::{Bound, Grid, Pass, Stage};
use limpid::resource::{Access, Copy, Count, Kind, Lifetime, Resource};
use limpid::synchronization::{Barrier, Usage};
use limpid::{Plan, Preset, Settings};
use proptest::prelude::*;

/// Frames that hazards are looked for in, with the same barriers in each.
const FRAMES: usize = 7;

fn name(index: usize) -> String {
    format!("r{index}")
}

fn any_plan() -> impl Strategy<Value = Plan> {
    use Lifetime::{External, Persistent, Transient};
    let lifetime = prop::sample::select(vec![Persistent, Persistent, Transient, Transient, Transient, External]);
    let resources = prop::collection::vec((any::<bool>(), lifetime), 1..5);
    let access = prop::sample::select(vec![Access::Read, Access::Read, Access::Write, Access::ReadWrite]);
    resources.prop_flat_map(move |resources| {
        let count = resources.len();
        let binding = (0..count, any::<bool>(), access.clone());
        let pass = (prop::collection::vec(binding, 0..4), prop::option::weighted(0.3, 0..count));
        (Just(resources), prop::collection::vec(pass, 1..7)).prop_map(|(resources, passes)| Plan {
            size: UVec2::splat(8),
            resources: resources
                .into_iter()
                .enumerate()
                .map(|(i, (ping_pong, lifetime))| Resource {
                    name: name(i),
                    kind: Kind::Buffer { stride: 4, count: Count::Fixed(1 + i as u64), indirect: true },
                    lifetime,
                    // What is gone after the frame needs no second copy.
                    ping_pong: ping_pong && lifetime != Transient,
                    exported: i == 0,
                })
                .collect(),
            // The first two are the classify stage.
            passes: passes
                .into_iter()
                .enumerate()
                .map(|(i, (bindings, indirect))| {
                    pass_of(if i < 2 { Stage::Classify } else { Stage::Denoise }, &bindings, indirect)
                })
                .collect(),
        })
    })
}

/// What is written in a pass is bound once in it.
fn pass_of(stage: Stage, bindings: &[(usize, bool, Access)], indirect: Option<usize>) -> Pass {
    let mut kept: Vec<(usize, bool, Access)> = Vec::new();
    for binding in bindings {
        if kept.iter().all(|k| k.0 != binding.0 || (k.2 == Access::Read && binding.2 == Access::Read)) {
            kept.push(*binding);
        }
    }
    let indirect = indirect.filter(|i| kept.iter().all(|k| k.0 != *i || k.2 == Access::Read));
    let bound = kept.iter().enumerate().map(|(i, &(resource, previous, access))| Bound {
        variable: format!("v{i}"),
        group: 1,
        binding: i as u32,
        resource: name(resource),
        copy: if previous { Copy::Previous } else { Copy::Current },
        access,
    });
    Pass {
        name: String::new(),
        kernel: String::new(),
        stage,
        overrides: Default::default(),
        grid: indirect.map_or(Grid::One, |resource| Grid::Indirect { resource: name(resource), offset: 0 }),
        bindings: bound.collect(),
    }
}

/// A use of a piece of memory by the pass at a place in a run of frames.
#[derive(Debug, Clone)]
struct Use {
    place: usize,
    /// Slot and copy.
    memory: (usize, usize),
    usage: Usage,
}

fn writes(usage: Usage) -> bool {
    matches!(usage, Usage::Kernel(Access::Write | Access::ReadWrite))
}

fn uses(plan: &Plan) -> Vec<Use> {
    let slots = plan.memory_slots();
    let slot_of = |name: &str| slots.iter().position(|slot| slot.iter().any(|&i| plan.resources[i].name == name));
    let mut uses = Vec::new();
    for frame in 0..FRAMES {
        for (index, pass) in plan.passes.iter().enumerate() {
            let mut note = |name: &str, copy: Copy, usage| {
                let resource = plan.resource(name).unwrap();
                if resource.lifetime != Lifetime::External {
                    let copy = if !resource.ping_pong {
                        0
                    } else if copy == Copy::Current {
                        frame % 2
                    } else {
                        (frame + 1) % 2
                    };
                    uses.push(Use {
                        place: frame * plan.passes.len() + index,
                        memory: (slot_of(name).unwrap(), copy),
                        usage,
                    });
                }
            };
            for bound in &pass.bindings {
                note(&bound.resource, bound.copy, Usage::Kernel(bound.access));
            }
            if let Grid::Indirect { resource, .. } = &pass.grid {
                note(resource, Copy::Current, Usage::Indirect);
            }
        }
    }
    uses
}

/// Pairs of uses of the same memory, one of which writes, with nothing between them that orders them.
fn hazards(plan: &Plan) -> Vec<(Use, Use)> {
    let uses = uses(plan);
    let mut hazards = Vec::new();
    for (i, before) in uses.iter().enumerate() {
        for after in uses[i + 1..].iter().filter(|after| after.memory == before.memory && after.place > before.place) {
            if !writes(before.usage) && !writes(after.usage) {
                continue;
            }
            let mut between =
                uses.iter().filter(|u| u.memory == before.memory && u.place > before.place && u.place < after.place);
            // A write between orders both; reads between two writes order them.
            let is_ordered = if writes(before.usage) && writes(after.usage) {
                between.next().is_some()
            } else {
                between.any(|u| writes(u.usage))
            };
            if !is_ordered {
                hazards.push((before.clone(), after.clone()));
            }
        }
    }
    hazards
}

fn covers(barriers: &[Option<Barrier>], (before, after): &(Use, Use)) -> bool {
    (before.place + 1..=after.place).any(|place| {
        let barrier = barriers[place % barriers.len()];
        barrier.is_some_and(|b| b.before.contains(before.usage) && b.after.contains(after.usage))
    })
}

/// Nothing shares memory while another one is used, and everything has its place.
fn check_memory(plan: &Plan) -> Result<(), TestCaseError> {
    let slots = plan.memory_slots();
    let mut placed: Vec<_> = slots.iter().flatten().copied().collect();
    placed.sort_unstable();
    let own = (0..plan.resources.len()).filter(|&i| plan.resources[i].lifetime != Lifetime::External);
    prop_assert_eq!(placed, own.collect::<Vec<_>>());
    for slot in slots.iter().filter(|slot| slot.len() > 1) {
        let mut users: Vec<Option<usize>> = vec![None; plan.passes.len()];
        for &index in slot {
            let resource = &plan.resources[index];
            prop_assert_eq!(resource.lifetime, Lifetime::Transient);
            for pass in plan.life(&resource.name).into_iter().flatten() {
                prop_assert_eq!(users[pass].replace(index), None);
            }
        }
    }
    // What the caller reads after the classify stage is still there then.
    if let (Some(life), true) = (plan.life(&name(0)), plan.passes.len() > 2) {
        prop_assert!(*life.end() == 1 || *life.end() == plan.passes.len() - 1);
    }
    let (shared, own) = (plan.shared_memory(), plan.memory());
    prop_assert_eq!(shared.persistent, own.persistent);
    prop_assert!(shared.transient <= own.transient);
    prop_assert_eq!(shared.transient < own.transient, slots.iter().any(|slot| slot.len() > 1));
    Ok(())
}

fn check(plan: &Plan) -> Result<(), TestCaseError> {
    let barriers = plan.barriers();
    let hazards = hazards(plan);
    prop_assert_eq!(barriers.len(), plan.passes.len());
    for hazard in &hazards {
        prop_assert!(covers(&barriers, hazard), "{:?} is not covered by {:?}", hazard, barriers);
    }
    for place in 0..barriers.len() {
        let mut fewer = barriers.clone();
        if fewer[place].take().is_some() {
            prop_assert!(!hazards.iter().all(|h| covers(&fewer, h)), "{} of {:?} is of no use", place, barriers);
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn barriers_cover_all_hazards_and_no_more(plan in any_plan()) {
        check(&plan)?;
        check_memory(&plan)?;
    }
}

#[test]
fn limpids_own_barriers() {
    let (plan, _) = Plan::new(&Preset::Reference.settings(), UVec2::splat(64)).unwrap();
    check(&plan).unwrap();
    let passes: Vec<_> =
        plan.passes.iter().zip(plan.barriers()).filter(|(_, b)| b.is_some()).map(|(p, _)| p.kernel.as_str()).collect();
    // Passes wait for each other, but `fill` and the second average wait for the same barrier, and so do `block_args` and
    // the first `block_spread`.
    let (plan, _) = Plan::new(&Settings::default(), UVec2::splat(64)).unwrap();
    check(&plan).unwrap();
    assert_eq!(plan.barriers().iter().flatten().count(), 13);
    // `fill` only needs what came before `reproject` and runs beside `prefilter`.
    assert_eq!(passes, ["list_tiles", "indirect_args", "reproject", "prefilter", "resolve_temporal"]);
}
