//! Dates and clock times of logs, as seconds from the first row.

use chrono::{DateTime, Datelike, Duration, FixedOffset, LocalResult, NaiveDate, NaiveDateTime, NaiveTime, TimeZone, Utc};
use chrono_tz::Tz;

use crate::header::is_time;
use crate::{Column, Ledger, Table, TextColumn};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Dimension, convert};

/// Name of the column of times.
pub const TIME: &str = "time";

/// Beginnings of the names of columns of times, in small letters and without blanks and signs.
const NAMES: [&str; 12] = ["time", "date", "ts", "utc", "clock", "zeit", "datum", "uhr", "heure", "horodatage", "fecha", "hora"];
/// Formats of dates, each with the words for it; days stand before months where dots separate them.
const DATES: [(&str, &str); 11] = [
    ("%Y-%m-%d", "year-month-day"),
    ("%Y/%m/%d", "year/month/day"),
    ("%d.%m.%Y", "day.month.year"),
    ("%d/%m/%Y", "day/month/year"),
    ("%m/%d/%Y", "month/day/year"),
    ("%d-%m-%Y", "day-month-year"),
    ("%d.%m.%y", "day.month.year"),
    ("%d/%m/%y", "day/month/year"),
    ("%m/%d/%y", "month/day/year"),
    ("%d-%b-%Y", "day-month-year"),
    ("%d %b %Y", "day month year"),
];
/// Formats of clock times; milliseconds may stand behind a colon.
const CLOCKS: [&str; 5] = ["%H:%M:%S%.f", "%H:%M", "%I:%M:%S%.f %p", "%I:%M %p", "%H:%M:%S:%3f"];
/// Names of columns of times with a unit, in small letters and without blanks and signs.
const NAMES_WITH_UNIT: [&str; 17] = [
    "time",
    "t",
    "zeit",
    "elapsed",
    "elapsedtime",
    "timeelapsed",
    "laufzeit",
    "reltime",
    "relativetime",
    "timestamp",
    "seconds",
    "sec",
    "minutes",
    "hours",
    "tijd",
    "temps",
    "tiempo",
];
/// Seconds since 1970 between 2001-09-09 and 2096-10-02: times of the clock, no times of a test.
const EPOCH: std::ops::Range<f64> = 1e9..4e9;
/// Days since 1899-12-30 between 1954 and 2118, as spreadsheets count them: dates, no times of a test.
const SERIAL_DAYS: std::ops::Range<f64> = 20_000.0..80_000.0;
/// Days from 1899-12-30 to 1970-01-01.
const SERIAL_OF_1970: f64 = 25_569.0;
/// Days since the year 0 between 1954 and 2118, as MATLAB's datenum counts them.
const DATENUM_DAYS: std::ops::Range<f64> = 713_700.0..773_700.0;
/// Days from the year 0 to 1970-01-01 (MATLAB's datenum(1970, 1, 1)).
const DATENUM_OF_1970: f64 = 719_529.0;
/// Smaller units in which clocks count the time since 1970, per second.
const SMALL_UNITS: [(f64, &str); 3] = [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")];
/// Largest usual step of times that look like days under a header in another unit: half an hour in days. Chosen: readings of
/// machines come in steps of seconds to minutes, hardly ever of hundredths of a second.
const STEP_OF_DAYS: f64 = 0.021;

/// A date, a clock time or both, as parts that may come from two columns.
#[derive(Clone, Copy)]
struct Stamp {
    local: NaiveDateTime,
    offset: Option<FixedOffset>,
}

/// Format of a column.
#[derive(Clone, Copy, PartialEq)]
struct StampFormat {
    date: Option<(&'static str, &'static str)>,
    clock: Option<&'static str>,
}

impl Table {
    /// Makes the column `time [s]` from columns of dates and clock times, and counts times of the clock from the first row. `zone` is
    /// a name of the IANA database, such as `Europe/Berlin`, for stamps that say none. A table without such columns stays as it is.
    ///
    /// # Errors
    /// Stamps of which the order of day and month cannot be told; some with and some without a zone; no such zone; a local time that
    /// the zone skips.
    pub fn read_stamps(&mut self, ledger: &mut Ledger, zone: Option<&str>) -> Result<()> {
        self.name_times(ledger);
        if let Some(column) = self.columns.iter_mut().find(|c| c.name == TIME) {
            return count_from_first(column, ledger);
        }
        let Some((parts, format)) = self.stamped()? else {
            self.read_elapsed(ledger);
            return Ok(());
        };
        let zone = match zone {
            Some(name) => Some(name.parse::<Tz>().map_err(|_| {
                Error::input("no such time zone")
                    .at_key("zone")
                    .read(name)
                    .help("write a name of the IANA database, such as \"Europe/Berlin\"")
            })?),
            None => None,
        };
        let columns: Vec<&TextColumn> = parts.iter().map(|part| &self.texts[*part]).collect();
        let names: Vec<String> = columns.iter().map(|c| format!("'{}'", c.name)).collect();
        let rows: Vec<String> =
            (0..self.rows()).map(|r| columns.iter().map(|c| c.values[r].trim()).collect::<Vec<_>>().join(" ")).collect();
        let at = |e: Error, row: usize| match ledger.line(row) {
            Some(line) => e.at_line(line).at_key(columns[0].name.clone()),
            None => e.at_key(columns[0].name.clone()),
        };
        let mut seconds = Vec::with_capacity(rows.len());
        let mut first: Option<(Stamp, DateTime<Utc>)> = None;
        let mut before: Option<DateTime<Utc>> = None;
        let mut midnights = 0;
        for (r, text) in rows.iter().enumerate() {
            let Some(mut stamp) = format.read(text) else {
                seconds.push(f64::NAN);
                continue;
            };
            if format.date.is_none() {
                stamp.local += Duration::days(midnights);
                // A clock without a date that falls by half a day or more has passed midnight.
                if before.is_some_and(|before| before.naive_utc() - stamp.local > Duration::hours(12)) {
                    midnights += 1;
                    stamp.local += Duration::days(1);
                }
            }
            if let Some((own, _)) = first.filter(|(own, _)| own.offset.is_some() != stamp.offset.is_some()) {
                let other = if own.offset.is_some() { "has no zone, and the first has one" } else { "has a zone, and the first has none" };
                return Err(at(Error::input(format!("this time {other}")).read(text).help("write all times in UTC"), r));
            }
            let time = stamp.utc(zone, before).map_err(|e| at(e.read(text), r))?;
            let start = first.get_or_insert((stamp, time)).1;
            before = Some(time);
            seconds.push((time - start).as_seconds_f64());
        }
        let Some((stamp, _)) = first else { return Ok(()) };
        let of_zone = match (stamp.offset, zone) {
            (Some(_), _) => "with their zone".to_string(),
            (None, Some(zone)) => format!("in {zone}"),
            (None, None) => "without a zone: the clock is taken to run on without a change".to_string(),
        };
        let order = format.date.map_or("clock times", |(_, words)| words);
        let shown = stamp.local.format(if format.date.is_some() { "%Y-%m-%d %H:%M:%S" } else { "%H:%M:%S" });
        ledger.assumed.push(format!("{} are times ({order}) {of_zone}; time runs from {shown}", names.join(" and ")));
        let mut n = 0;
        self.texts.retain(|_| {
            n += 1;
            !parts.contains(&(n - 1))
        });
        self.columns.insert(self.inputs, Column { name: TIME.into(), unit: "s".into(), values: seconds });
        Ok(())
    }

    /// Calls the one column with a unit of time and a name such as `Time` or `Zeit` by its name here, if no other is called so.
    fn name_times(&mut self, ledger: &mut Ledger) {
        if self.columns.iter().any(|c| c.name == TIME) {
            return;
        }
        let mut called = self.columns.iter_mut().filter(|c| is_time(&c.unit) && NAMES_WITH_UNIT.contains(&plain(&c.name).as_str()));
        if let (Some(column), None) = (called.next(), called.next()) {
            ledger.assumed.push(format!("'{}' holds the times", column.header()));
            column.name = TIME.into();
        }
    }

    /// Makes the column of times from texts such as `36:15:00`, hours that count on beyond a day.
    fn read_elapsed(&mut self, ledger: &mut Ledger) {
        let is_called = |column: &TextColumn| NAMES.iter().any(|own| plain(&column.name).starts_with(own));
        let seconds = |column: &TextColumn| column.values.iter().map(|text| elapsed(text)).collect::<Option<Vec<f64>>>();
        let found = self.texts.iter().enumerate().filter(|(_, column)| is_called(column)).find_map(|(i, c)| Some((i, seconds(c)?)));
        let Some((i, values)) = found.filter(|(_, values)| !values.is_empty()) else { return };
        let name = self.texts.remove(i).name;
        ledger.assumed.push(format!("'{name}' holds hours, minutes and seconds that count on beyond a day"));
        self.columns.insert(self.inputs, Column { name: TIME.into(), unit: "s".into(), values });
    }

    /// Text columns that hold the time of each row, and their format; a date and a clock may stand in two columns.
    fn stamped(&self) -> Result<Option<(Vec<usize>, StampFormat)>> {
        let tests = self.text("test").map_or(0, |t| t.values.iter().collect::<std::collections::HashSet<_>>().len());
        let is_log = tests == 0 || 2 * tests <= self.rows();
        let mut found: Vec<(usize, StampFormat)> = Vec::new();
        for (i, column) in self.texts.iter().enumerate() {
            if is_log
                && NAMES.iter().any(|own| plain(&column.name).starts_with(own))
                && let Some(format) = format_of(&column.values).map_err(|e| e.at_key(column.name.clone()))?
            {
                found.push((i, format));
            }
        }
        if let Some((i, format)) = found.iter().find(|(_, f)| f.date.is_some() && f.clock.is_some()) {
            return Ok(Some((vec![*i], *format)));
        }
        let date = found.iter().find(|(_, f)| f.clock.is_none());
        let clock = found.iter().find(|(_, f)| f.date.is_none());
        Ok(match (date, clock) {
            (Some((d, date)), Some((c, clock))) => Some((vec![*d, *c], StampFormat { date: date.date, clock: clock.clock })),
            (None, Some((c, clock))) => Some((vec![*c], *clock)),
            (Some((d, date)), None) => Some((vec![*d], *date)),
            (None, None) => None,
        })
    }
}

/// A name in small letters, without blanks and signs.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Seconds of hours, minutes and seconds with colons between.
fn elapsed(text: &str) -> Option<f64> {
    let parts: Vec<&str> = text.trim().split(':').collect();
    let [hours, minutes, seconds] = parts[..] else { return None };
    let below_60 = |value: f64| Some(value).filter(|value| (0.0..60.0).contains(value));
    let minutes = below_60(f64::from(minutes.parse::<u32>().ok()?))?;
    let seconds = below_60(seconds.replace(',', ".").parse().ok()?)?;
    Some(3600.0 * f64::from(hours.parse::<u32>().ok()?) + 60.0 * minutes + seconds)
}

/// Whether a text is a date, a clock time or both, or hours, minutes and seconds that count on beyond a day.
pub fn is_stamp(text: &str) -> bool {
    text.contains([':', '-', '/', '.']) && (elapsed(text).is_some() || formats().any(|format| format.read(text.trim()).is_some()))
}

fn formats() -> impl Iterator<Item = StampFormat> {
    let both = DATES.into_iter().flat_map(|date| CLOCKS.into_iter().map(move |clock| StampFormat { date: Some(date), clock: Some(clock) }));
    let dates = DATES.into_iter().map(|date| StampFormat { date: Some(date), clock: None });
    both.chain(dates).chain(CLOCKS.into_iter().map(|clock| StampFormat { date: None, clock: Some(clock) }))
}

/// Format of all filled texts; `None` if they are no stamps.
fn format_of(texts: &[String]) -> Result<Option<StampFormat>> {
    let filled: Vec<&str> = texts.iter().map(|t| t.trim()).filter(|t| !t.is_empty()).collect();
    let Some(first) = filled.first() else { return Ok(None) };
    let fitting: Vec<StampFormat> =
        formats().filter(|f| f.read(first).is_some()).filter(|f| filled.iter().all(|text| f.read(text).is_some())).collect();
    let orders: Vec<&str> = fitting.iter().filter_map(|f| f.date).map(|(_, words)| words).collect();
    if orders.contains(&"day/month/year") && orders.contains(&"month/day/year") {
        let error = Error::input("day and month of these dates cannot be told apart").read(*first);
        return Err(error.help("write dates as year-month-day"));
    }
    Ok(fitting.first().copied())
}

impl StampFormat {
    fn read(self, text: &str) -> Option<Stamp> {
        let (text, offset) = if self.clock.is_some() { split_offset(text) } else { (text, None) };
        // Fractions of a second may stand behind a comma.
        let text = text.replace(',', ".");
        let (date, clock) = match (self.date, self.clock) {
            (Some(_), Some(_)) => {
                let at = text.find(':')?;
                let at = text[..at].rfind([' ', 'T'])?;
                (text[..at].trim_end().to_string(), text[at + 1..].to_string())
            }
            (Some(_), None) => (text, String::new()),
            _ => (String::new(), text),
        };
        let date = match self.date {
            // Four digits are asked of a year that is written in full.
            Some((format, _)) => NaiveDate::parse_from_str(&date, format).ok().filter(|date| date.year() > 999)?,
            None => NaiveDate::default(),
        };
        // The end of a day may be written as its 24th hour.
        let is_midnight = clock.trim().starts_with("24:") && clock.trim()[2..].chars().all(|c| matches!(c, ':' | '0' | '.'));
        let clock = if is_midnight { clock.replacen("24:", "00:", 1) } else { clock };
        let time = match self.clock {
            Some(format) => NaiveTime::parse_from_str(&clock, format).ok()?,
            None => NaiveTime::MIN,
        };
        Some(Stamp { local: NaiveDateTime::new(date, time) + Duration::days(i64::from(is_midnight)), offset })
    }
}

/// A text without the zone at its end, and the zone.
fn split_offset(text: &str) -> (&str, Option<FixedOffset>) {
    for name in ["Z", "UTC", "GMT"] {
        if let Some(rest) = text.strip_suffix(name) {
            return (rest.trim_end(), FixedOffset::east_opt(0));
        }
    }
    let clock = text.find(':').unwrap_or(text.len());
    let Some(at) = text[clock..].find(['+', '-']).map(|at| clock + at) else { return (text, None) };
    let digits: String = text[at + 1..].chars().filter(char::is_ascii_digit).collect();
    let minutes = match (digits.len(), digits.parse::<i32>()) {
        (2, Ok(hours)) => hours * 60,
        (4, Ok(both)) => both / 100 * 60 + both % 100,
        _ => return (text, None),
    };
    let sign = if text[at..].starts_with('-') { -60 } else { 60 };
    (text[..at].trim_end(), FixedOffset::east_opt(sign * minutes))
}

impl Stamp {
    /// The time in UTC. Of an hour that stands twice, the first one that does not lie before the row above.
    fn utc(self, zone: Option<Tz>, before: Option<DateTime<Utc>>) -> Result<DateTime<Utc>> {
        if let Some(offset) = self.offset {
            return Ok((self.local - offset).and_utc());
        }
        let Some(zone) = zone else { return Ok(self.local.and_utc()) };
        match zone.from_local_datetime(&self.local) {
            LocalResult::Single(time) => Ok(time.to_utc()),
            LocalResult::Ambiguous(first, second) => {
                Ok(if before.is_some_and(|before| first.to_utc() <= before) { second.to_utc() } else { first.to_utc() })
            }
            LocalResult::None => Err(Error::input(format!("there is no such time in {zone}: the clock was set forward over it"))),
        }
    }
}

/// Counts times of a clock, the time since 1970 or days of a spreadsheet or of MATLAB, from the first row.
///
/// # Errors
/// Days under a header in another unit.
fn count_from_first(column: &mut Column, ledger: &mut Ledger) -> Result<()> {
    let Some(first) = column.values.iter().copied().find(|v| !v.is_nan()) else { return Ok(()) };
    let Ok(seconds) = convert(first, &column.unit, Dimension::TIME) else { return Ok(()) };
    let days = seconds / 86_400.0;
    let is_in_days = column.unit.trim() == "d";
    let small = SMALL_UNITS.into_iter().find(|(per_second, _)| EPOCH.contains(&(first / per_second)));
    // The time of the first row since 1970, s; that of the rows for one in the file, s; the last digit that is kept, s.
    let (since, per_unit, digit, what) = if is_in_days && SERIAL_DAYS.contains(&days) {
        ((days - SERIAL_OF_1970) * 86_400.0, 86_400.0, 1e-3, "days as spreadsheets count them".to_string())
    } else if is_in_days && DATENUM_DAYS.contains(&days) {
        ((days - DATENUM_OF_1970) * 86_400.0, 86_400.0, 1e-3, "days as MATLAB counts them (datenum)".to_string())
    } else if EPOCH.contains(&seconds) {
        (seconds, seconds / first, 1e-3, "the time since 1970, UTC".to_string())
    } else if let Some((per_second, name)) = small {
        (first / per_second, 1.0 / per_second, 1e-6, format!("the time since 1970 in {name}, UTC, whatever its header says"))
    } else {
        return not_days(column, first).map_or(Ok(()), Err);
    };
    let start =
        DateTime::from_timestamp_millis((since * 1e3).round() as i64).map_or(String::new(), |t| t.format("%Y-%m-%d %H:%M:%S").to_string());
    ledger.assumed.push(format!("'{}' holds {what}; time runs from {start}", column.header()));
    for value in &mut column.values {
        // Days with nine decimals are exact to a tenth of a millisecond.
        *value = ((*value - first) * per_unit / digit).round() * digit;
    }
    column.unit = "s".into();
    Ok(())
}

/// Error of a column that counts days under a header in another unit.
fn not_days(column: &Column, first: f64) -> Option<Error> {
    let is_date = SERIAL_DAYS.contains(&first) || DATENUM_DAYS.contains(&first);
    let mut steps: Vec<f64> = column.values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2)?;
    let error = Error::input("these times look like days of a calendar").at_key(column.header()).read(first);
    let help = "write 'time [d]' in the header for days of a spreadsheet or of MATLAB; if it is right, begin the times at 0";
    (is_date && column.unit.trim() != "d" && *usual < STEP_OF_DAYS).then(|| error.help(help))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str, zone: Option<&str>) -> Result<(Vec<f64>, Vec<String>)> {
        let (mut table, mut ledger) = Table::from_text(text, Path::new("f.csv"), Ledger::default())?;
        table.read_stamps(&mut ledger, zone)?;
        Ok((table.column(TIME)?.values.clone(), ledger.assumed))
    }

    #[test]
    fn dates_of_every_kind_become_seconds() {
        for (header, first, second) in [
            ("time", "2024-05-01 10:00:00", "2024-05-01 10:01:30"),
            ("time [s]", "2024-05-01T10:00:00Z", "2024-05-01T12:01:30+02:00"),
            ("Timestamp", "01.05.2024 23:59:00", "02.05.2024 00:00:30"),
            ("Date/Time", "13/05/2024 10:00:00", "13/05/2024 10:01:30"),
            ("Date/Time", "5/13/2024 11:59:00 AM", "5/13/2024 12:00:30 PM"),
            ("Zeit", "23:59:00", "00:00:30"),
            ("Date Time GMT+02:00", "05/13/24 10:00:00 AM", "05/13/24 10:01:30 AM"),
            ("time [ms]", "1553424480000", "1553424570000"),
            ("time [d]", "45231.708333333", "45231.709375"),
            ("time [s]", "1553424480000", "1553424570000"),
            ("time [d]", "738000.708333333", "738000.709375"),
            ("Timestamp", "01.05.2024 10:00:00:250", "01.05.2024 10:01:30:250"),
            ("Date/Time", "2024-05-01 23:58:30", "2024-05-01 24:00:00"),
            ("Zeit", "23:58:30", "24:00:00"),
        ] {
            let text = format!("{header},motor [degC]\n{first},20\n{second},21\n");
            let (times, assumed) = read(&text, None).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!(times[0] == 0.0 && (times[1] - 90.0).abs() < 1e-3, "{text}: {times:?}");
            assert!(assumed.iter().any(|s| s.contains("time runs from")), "{assumed:?}");
        }
        let (times, _) = read("date,clock,motor [degC]\n2024-05-01,,20\n2024-05-02,,21\n", None).unwrap();
        assert_eq!(times, [0.0, 86_400.0]);
        let (times, assumed) = read("Datum;Uhrzeit;motor [degC]\n01.05.24;23:00;20\n02.05.24;01:00;21\n", None).unwrap();
        assert!(times == [0.0, 7200.0] && assumed.iter().any(|s| s.contains("2024-05-01 23:00:00")), "{assumed:?}");
        let (times, _) = read("Date,Time,motor [degC]\n2024-05-01,23:00,20\n2024-05-02,01:00,21\n", None).unwrap();
        assert_eq!(times, [0.0, 7200.0]);
    }

    #[test]
    fn columns_of_times_are_found_by_name_and_unit() {
        for (header, first, second) in [
            ("Time [s]", "0", "90"),
            ("Zeit [min]", "0", "1.5"),
            ("seconds", "0", "90"),
            ("Elapsed_s", "0", "90"),
            ("Laufzeit", "1:00", "2:30"),
            ("time", "23:59:00", "24:00:30"),
            ("time", "100:00:00", "100:01:30"),
        ] {
            let text = format!("{header},motor [degC]\n{first},20\n{second},21\n");
            let Ok((mut table, mut ledger)) = Table::from_text(&text, Path::new("f.csv"), Ledger::default()) else { panic!("{text}") };
            table.read_stamps(&mut ledger, None).unwrap();
            let seconds = table.column_si(TIME, Dimension::TIME);
            if header == "Laufzeit" {
                assert!(seconds.is_err(), "hours and minutes, or minutes and seconds");
                continue;
            }
            let seconds = seconds.unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!((seconds[1] - seconds[0] - 90.0).abs() < 1e-9 && !ledger.assumed.is_empty(), "{text}: {seconds:?}");
        }
        let days = read("time [s],motor [degC]\n738000.5,20\n738000.501,21\n738000.502,21\n", None).unwrap_err().to_string();
        assert!(days.contains("time [d]"), "{days}");
    }

    #[test]
    fn day_and_month_are_not_guessed() {
        let message = read("time,motor [degC]\n01/02/2024 10:00,20\n01/02/2024 10:01,21\n", None).unwrap_err().to_string();
        assert!(message.contains("cannot be told apart"), "{message}");
    }

    #[test]
    fn a_named_zone_tells_the_hour_that_stands_twice() {
        let text = "time,motor [degC]\n2024-10-27 02:30,20\n2024-10-27 02:00,21\n2024-10-27 03:00,21\n";
        let (times, _) = read(text, Some("Europe/Berlin")).unwrap();
        assert_eq!(times, [0.0, 1800.0, 5400.0]);
        let skipped = read("time,motor [degC]\n2024-03-31 01:30,20\n2024-03-31 02:30,21\n", Some("Europe/Berlin")).unwrap_err();
        assert!(skipped.to_string().contains("set forward"), "{skipped}");
        assert!(read(text, Some("Berlin")).unwrap_err().to_string().contains("IANA"));
    }

    #[test]
    fn names_of_tests_with_a_date_stay_steady_readings() {
        let text = "test,date,motor [degC]\na,2024-05-01,20\nb,2024-05-02,21\n";
        assert!(read(text, None).is_err());
    }
}
