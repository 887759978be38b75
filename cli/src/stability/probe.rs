//! What happens to numbers inside of the kernels while cases run: see [`limpid_cpu::Probe`].

use std::collections::BTreeMap;
use std::fmt;

use anyhow::Result;
use limpid::Preset;
use limpid_cpu::{Event, EventKind, OutputError};
use serde::Serialize;

use super::case::Case;
use crate::backend::{Backend, Cpu};

/// Most places that are printed of a kernel's events, and of its outputs.
const SHOWN: usize = 6;

/// Something that happened at one place, in all cases together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceEvent {
    /// What.
    pub kind: &'static str,
    /// File and line.
    pub place: String,
    /// How often.
    pub count: u64,
    /// Case of the first time.
    pub case: String,
    /// Operands and result of the first time, as text.
    pub first: String,
}

/// The largest rounding error of what one place writes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceError {
    /// File and line.
    pub place: String,
    /// Values written.
    pub count: u64,
    /// Relative to the exact value, taken as at least the smallest normal half float.
    pub relative: f64,
    /// The value and the exact one, as text.
    pub values: String,
    /// File and line where most of the error arose.
    pub origin: String,
    /// The case.
    pub case: String,
}

/// What was seen of a kernel.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct KernelProbe {
    /// Float operations.
    pub operations: u64,
    /// Most frequent first.
    pub events: Vec<PlaceEvent>,
    /// Largest error first.
    pub outputs: Vec<PlaceError>,
}

/// What was seen, by kernel.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ProbeReport(pub BTreeMap<&'static str, KernelProbe>);

fn kind_name(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Nan => "NaN",
        EventKind::Infinite => "infinity",
        EventKind::Denormal => "denormal",
        EventKind::Cancellation => "cancellation",
        _ => "other",
    }
}

impl KernelProbe {
    fn add_event(&mut self, event: &Event, place: String, case: &str) {
        let kind = kind_name(event.kind);
        match self.events.iter_mut().find(|own| own.place == place && own.kind == kind) {
            Some(own) => own.count += event.count,
            None => {
                let first = format!("{:?} gave {:?}", event.operands, event.value);
                self.events.push(PlaceEvent { kind, place, count: event.count, case: case.to_owned(), first });
            }
        }
    }

    fn add_output(&mut self, error: &OutputError, place: String, origin: String, case: &str) {
        let values = format!("{:?} for {:.6e}", error.value, error.exact);
        let (count, relative, case) = (error.count, error.relative, case.to_owned());
        let new = PlaceError { place, count, relative, values, origin, case };
        match self.outputs.iter_mut().find(|own| own.place == new.place) {
            Some(own) if own.relative >= new.relative => own.count += new.count,
            Some(own) => *own = PlaceError { count: own.count + new.count, ..new },
            None => self.outputs.push(new),
        }
    }
}

impl ProbeReport {
    /// Runs a case with the default preset and adds what is seen.
    ///
    /// # Errors
    ///
    /// When the backend cannot be opened. A frame that is refused ends the case.
    pub fn add(&mut self, case: &Case) -> Result<()> {
        let mut cpu = Cpu::open_probed(&case.settings_of(Preset::Default), case.size)?;
        for number in 0..case.frames {
            let (frame, exposure) = case.frame(number, &case.paint);
            if cpu.denoise(&frame, exposure, None).is_err() {
                break;
            }
        }
        for (kernel, probe) in cpu.denoiser().probes() {
            let own = self.0.entry(kernel).or_default();
            own.operations += probe.operations;
            let place = |offset| cpu.denoiser().place(kernel, offset);
            probe.events.iter().for_each(|event| own.add_event(event, place(event.offset), &case.name));
            for error in &probe.outputs {
                own.add_output(error, place(error.offset), place(error.origin), &case.name);
            }
            own.events.sort_by_key(|event| std::cmp::Reverse(event.count));
            own.outputs.sort_by(|a, b| b.relative.total_cmp(&a.relative));
        }
        Ok(())
    }
}

impl fmt::Display for ProbeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (kernel, probe) in &self.0 {
            writeln!(f, "{kernel}: {} float operations", probe.operations)?;
            for error in probe.outputs.iter().take(SHOWN) {
                let PlaceError { place, relative, values, origin, case, .. } = error;
                writeln!(f, "  error {relative:9.2e} written at {place:<36} {values}, from {origin} ({case})")?;
            }
            for event in probe.events.iter().take(SHOWN) {
                let PlaceEvent { kind, place, count, case, first } = event;
                writeln!(f, "  {kind:<12} {count:>9} times at {place:<36} {first} ({case})")?;
            }
            let more = probe.events.len().saturating_sub(SHOWN);
            if more > 0 {
                writeln!(f, "  and events at {more} places more; --json has all")?;
            }
        }
        Ok(())
    }
}
