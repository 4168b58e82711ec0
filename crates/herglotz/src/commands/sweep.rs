//! `herglotz sweep`.

use super::run::{header_of_events, numbers_of_event};
use super::scene_arguments::{FormulaOrBody, SceneArguments};
use super::sweep_writer::{Drawn, MemberEndRow, MemberRow, SweepOutput, SweepWriter};
use crate::failure::Failure;
use crate::output::{Directory, print, print_json};
use crate::plot;
use clap::Args;
use herglotz::runtime::{Column, Crossing, Ending, Ensemble, Event, MemberEnd, Status, Tally, Varied};
use herglotz::{Combinations, Scene};
use std::path::PathBuf;

#[derive(Args)]
pub(crate) struct Sweep {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// The directory of sweep.csv, and of events.csv where the scene has events; by default one with the name of the
    /// scene.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// The number of threads; the results do not depend on it.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
    /// Draw the columns at the end, and the coordinates and columns of the first event, against the first swept
    /// quantity.
    #[arg(long)]
    pub(super) plot: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(super) json: bool,
}

/// The status of a member in one word, and its reason.
fn words(ending: &Ending) -> (&'static str, String) {
    let why = ending.unresolved.map(|unresolved| unresolved.to_string()).unwrap_or_default();
    match ending.status {
        Status::Completed if ending.unresolved.is_some() => ("unresolved", why),
        Status::Completed => ("completed", why),
        status @ Status::Stopped { .. } => ("stopped", status.to_string()),
        status @ Status::FalseClaim { .. } => ("unreliable", status.to_string()),
        status => ("failed", status.to_string()),
    }
}

/// A member of a sweep of a scene as it is written.
fn row_of(scene: &Scene, member: MemberEnd) -> MemberRow {
    let event = |crossing: &Crossing| {
        let name = scene.events.get(crossing.event).map(|(name, _)| name.clone()).unwrap_or_default();
        [name].into_iter().chain(numbers_of_event(scene, crossing)).collect()
    };
    let of_first = member.crossings.iter().filter(|crossing| crossing.event == 0);
    MemberRow {
        index: member.index,
        events: member.crossings.iter().map(event).collect(),
        first_event: of_first.map(|crossing| [&crossing.q[..], &crossing.columns].concat()).collect(),
        end: match member.ending {
            Ok(ending) => {
                Ok(MemberEndRow { status: words(&ending), steps: ending.steps, t: ending.t, columns: ending.columns })
            }
            Err(cause) => Err(cause.to_string()),
        },
    }
}

/// The names and the kinds of the columns that are drawn.
pub(super) struct DrawnColumns<'n> {
    /// The columns at the end.
    pub at_end: &'n [&'n str],
    /// The numbers at the first event.
    pub at_first_event: &'n [&'n str],
    /// Whether a column is an angle.
    pub is_angle: &'n dyn Fn(&str) -> bool,
}

impl Sweep {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = match self.scene.read_formula_or_body()? {
            FormulaOrBody::Formula(scene) => scene,
            FormulaOrBody::Body(scene) => return self.sweep_body(&scene),
        };
        let members = scene.members();
        self.require_values(members.combinations())?;
        let refuse = |why: &str| Failure::Input(format!("{}: {why}", self.scene.file.display()));
        let factor = scene.columns.iter().find(|(_, column)| column.has_conformal_factor());
        let terminal = scene.events.iter().find(|(_, event)| event.terminal);
        if let (Some((column, _)), Some((event, _))) = (factor, terminal) {
            return Err(refuse(&format!(
                "the column `{column}` of a sweep is known only at the ends of steps, but the terminal event \
                 `{event}` ends a motion within a step; remove one of them"
            )));
        }
        // The time is a column of its own.
        let shown = scene.columns.iter().filter(|(_, column)| !matches!(column, Column::Time));
        let (names, columns): (Vec<&str>, Vec<Column>) =
            shown.map(|(name, column)| (name.as_str(), column.clone())).unzip();
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let of_events = (!scene.events.is_empty()).then(|| header_of_events(&scene));
        let combinations = members.combinations();
        let mut writer =
            SweepWriter::new(&directory, combinations, &names, of_events.as_deref(), (self.plot, !self.json))?;
        let motion = scene.bare_motion();
        let events: Vec<Event> = scene.events.iter().map(|(_, event)| event.clone()).collect();
        let parameters = members.parameters();
        let (start, values) = (|i: usize| members.start(i), |i: usize| members.parameter_values(i));
        let varied = Varied { names: &parameters, values: &values };
        let ensemble = Ensemble {
            count: members.count(),
            start: &start,
            t0: members.t0(),
            varied: (!parameters.is_empty()).then_some(varied),
            end: motion.end,
            step_control: motion.step_control,
            rows: None,
            columns: &columns,
            events: &events,
            threads: self.threads.map(usize::from),
        };
        let tally = scene.system.ensemble(&ensemble, &mut |member: MemberEnd| writer.member(row_of(&scene, member)));
        writer.end_progress();
        let tally = tally.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let at_first = scene.columns_of_first_event();
        let at_first: Vec<&str> = at_first.iter().map(String::as_str).collect();
        let is_angle = |name: &str| scene.is_angle(name);
        let drawn = DrawnColumns { at_end: &names, at_first_event: &at_first, is_angle: &is_angle };
        self.complete(&directory, combinations, &drawn, tally, writer.finish()?)
    }

    /// Refuses a scene without swept values.
    pub(super) fn require_values(&self, members: Combinations<'_>) -> Result<(), Failure> {
        if members.swept().is_empty() {
            return Err(Failure::Input(format!(
                "{}: the scene has no swept values; add [sweep] with a parameter, as in gamma = {{ from = -1.0, to = \
                 0.0, count = 11 }}",
                self.scene.file.display()
            )));
        }
        Ok(())
    }

    /// Draws the figures and prints the summary.
    pub(super) fn complete(
        &self,
        directory: &Directory,
        members: Combinations<'_>,
        columns: &DrawnColumns<'_>,
        tally: Tally,
        output: SweepOutput,
    ) -> Result<(), Failure> {
        let SweepOutput { members: written, is_interrupted, drawn: [ends, at_events] } = output;
        let quantity = members.swept().first().map(|quantity| quantity.name.as_str()).unwrap_or_default();
        for (file, names, points) in
            [("sweep", columns.at_end, ends), ("sweep_events", columns.at_first_event, at_events)]
        {
            for (i, name) in names.iter().enumerate() {
                let of = |(value, numbers): &Drawn| Some((*value, *numbers.get(i)?)).filter(|p| p.1.is_finite());
                let points = points.iter().filter_map(of).collect();
                if let Some(figure) = plot::of_sweep(quantity, (name, (columns.is_angle)(name)), points) {
                    directory.write(&format!("{file}_{i}.svg"), &figure)?;
                }
            }
        }
        let Tally { completed, stopped, failed, unresolved, own_plans, .. } = tally;
        if self.json {
            let summary = serde_json::json!({
                "members": written, "completed": completed, "stopped": stopped, "failed": failed, "unresolved": unresolved,
                "own_plans": own_plans,
            });
            print_json(&summary)?;
        } else {
            let stopped = if stopped > 0 { format!(", {stopped} stopped by an event") } else { String::new() };
            print(&format!(
                "{written} members: {completed} completed ({unresolved} unresolved), {failed} failed{stopped}"
            ))?;
        }
        if is_interrupted {
            return Err(Failure::Run(format!("interrupted after {written} of {} members", members.count())));
        }
        Ok(())
    }
}
