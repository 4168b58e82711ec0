//! `herglotz sweep` for a rigid body.

use super::body::{header_of_events, row_of_event};
use super::sweep::{DrawnColumns, Sweep};
use super::sweep_writer::{MemberEndRow, MemberRow, SweepWriter};
use crate::failure::Failure;
use crate::output::Directory;
use herglotz::BodyScene;
use herglotz::runtime::{Body, BodyEnsemble, BodyMember, BodyOutcome, GroupStatus, Interrupt};
use std::sync::atomic::Ordering;

/// The status of a member in one word, and its reason.
fn words(scene: &BodyScene, outcome: &BodyOutcome) -> (&'static str, String) {
    match outcome.status {
        GroupStatus::Completed => ("completed", String::new()),
        GroupStatus::Event { event, t } => {
            let name = scene.events.get(event).map_or("", String::as_str);
            ("stopped", format!("stopped by the event {name} at t = {t}"))
        }
        status @ GroupStatus::Stopped { .. } => ("stopped", status.to_string()),
        status @ GroupStatus::Failed { .. } => ("failed", status.to_string()),
    }
}

/// A member as it is written; `columns` are the numbers of the columns at the end.
fn row_of(scene: &BodyScene, columns: &[usize], member: BodyMember) -> MemberRow {
    let of_first = member.crossings.iter().filter(|crossing| crossing.event == 0);
    MemberRow {
        index: member.index,
        events: member.crossings.iter().map(|crossing| row_of_event(scene, crossing)).collect(),
        first_event: of_first.map(|crossing| crossing.columns.clone()).collect(),
        end: match &member.outcome {
            Ok(outcome) => {
                let row = outcome.row();
                Ok(MemberEndRow {
                    status: words(scene, outcome),
                    steps: outcome.steps,
                    t: outcome.t,
                    columns: columns.iter().filter_map(|k| row.get(*k).copied()).collect(),
                })
            }
            Err(cause) => Err(cause.to_string()),
        },
    }
}

impl Sweep {
    /// Runs the sweep of a scene of a rigid body.
    pub(super) fn sweep_body(&self, scene: &BodyScene) -> Result<(), Failure> {
        let members = scene.combinations();
        self.require_values(members)?;
        // The time is a column of its own.
        let columns: Vec<usize> = scene.columns.iter().copied().filter(|k| *k != 0).collect();
        let names: Vec<&str> = columns.iter().filter_map(|k| Body::COLUMNS.get(*k).copied()).collect();
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let of_events = header_of_events(scene);
        let mut writer = SweepWriter::new(&directory, members, &names, of_events.as_deref(), (self.plot, !self.json))?;
        let stop = writer.stop.clone();
        let ensemble = BodyEnsemble {
            count: members.count(),
            member: &|index| scene.member(index),
            threads: self.threads.map(usize::from),
            interrupt: Some(Interrupt::when(move || stop.load(Ordering::Relaxed))),
        };
        let tally = ensemble.run(&mut |member| writer.member(row_of(scene, &columns, member)));
        writer.end_progress();
        let tally = tally.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let drawn = DrawnColumns { at_end: &names, at_first_event: &Body::COLUMNS, is_angle: &|_| false };
        self.complete(&directory, members, &drawn, tally, writer.finish()?)
    }
}
