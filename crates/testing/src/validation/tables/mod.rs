//! Tables 7 to 10 as measurements: which machine would give them, each alone and all together.

mod forbidden;
pub mod numbers;
mod page;
pub mod search;

use coldplate_base::atomic_file;
use coldplate_base::error::Result;

use crate::validation::common::{Outcome, Section, project, verdict, wrapped};
use crate::validation::fits::{AGREE, published};
use search::{Compared, Found, compared};

/// The tables.
pub const TABLES: [usize; 4] = [7, 8, 9, 10];

/// All that the page tells.
pub struct Study {
    /// Every curve beside the machine as shipped.
    pub shipped: Vec<Compared>,
    /// Each table alone, in the order of [`TABLES`].
    pub alone: Vec<Found>,
    pub together: Found,
}

/// Identifies each table alone and all together.
pub fn study(cells: Option<usize>) -> Result<Study> {
    let together = search::found(search::problem(None, cells)?)?;
    let machine = crate::validation::common::study("five_axis.toml", &[], cells)?;
    let shipped = compared(&together.problem.data, &|_| Ok(machine.clone()))?;
    let alone = TABLES.iter().map(|t| search::found(search::problem(Some(*t), cells)?)).collect::<Result<_>>()?;
    Ok(Study { shipped, alone, together })
}

/// Writes the measurements, the numbers found and docs/record/paper-tables.md; the section points there.
pub fn section(cells: Option<usize>) -> Result<Section> {
    atomic_file::write(&project(search::DATA), search::table()?.as_bytes())?;
    let study = study(cells)?;
    atomic_file::write(&project("data/paper").join(search::FOUND), search::record(&study.together).as_bytes())?;
    atomic_file::write(&project("docs/record/paper-tables.md"), wrapped(&page::page(&study, &published()?, cells)?).as_bytes())?;
    let (count, own) = (study.together.curves.len(), study.together.problem.free.iter().filter(|f| f.test.is_some()).count());
    let alone: usize = study.alone.iter().map(Found::agreeing).sum();
    let mut section = Section {
        text: format!(
            "The same tables given to the program as measurements, one test per table: which machine would give them? With {} numbers common to all tables and {own} heats \
             that one table has for itself **{} of {count} curves agree**, {alone} where each table stands alone. [The paper's tables](paper-tables.md) has every curve, every \
             number with its interval, and for the others the printed number that forbids them.\n\n",
            study.together.problem.free.len() - own,
            study.together.agreeing(),
        ),
        ..Section::default()
    };
    section.verdicts.push(verdict(
        Outcome::Improved,
        format!("curves of Tables 7 to 10 within {AGREE} K in offset and rise, one machine whose heats differ from table to table"),
        format!(
            "{} of {count}, each table alone {alone} of {count}; the study's tables cannot be of one machine with one set of heats",
            study.together.agreeing()
        ),
    ));
    Ok(section)
}
