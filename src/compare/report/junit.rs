//! Results as JUnit XML, which continuous integration reads and shows.

use std::fmt::Write;

use super::escaped;

/// One golden frame, as a test.
#[derive(Clone, Debug, Default)]
pub struct JunitCase {
    /// What it belongs to: the name of its entry.
    pub suite: String,
    /// What was tested.
    pub name: String,
    /// Why it failed, in one line; `None` if it passed.
    pub failure: Option<String>,
    /// What else is to be said of the failure.
    pub details: String,
}

/// The file of all cases, those of a suite together. It holds no times: they differ from run to run.
pub fn junit(name: &str, cases: &[JunitCase]) -> String {
    let failures = |cases: &[JunitCase]| cases.iter().filter(|case| case.failure.is_some()).count();
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let (tests, failed) = (cases.len(), failures(cases));
    let _ =
        writeln!(xml, "<testsuites name=\"{}\" tests=\"{tests}\" failures=\"{failed}\" errors=\"0\">", escaped(name));
    for suite in cases.chunk_by(|a, b| a.suite == b.suite) {
        let (of, tests, failed) = (escaped(&suite[0].suite), suite.len(), failures(suite));
        let _ = writeln!(
            xml,
            "  <testsuite name=\"{of}\" tests=\"{tests}\" failures=\"{failed}\" errors=\"0\" skipped=\"0\">"
        );
        for case in suite {
            let start = format!("    <testcase classname=\"{of}\" name=\"{}\"", escaped(&case.name));
            let _ = match &case.failure {
                None => writeln!(xml, "{start}/>"),
                Some(failure) => writeln!(
                    xml,
                    "{start}>\n      <failure message=\"{}\">{}</failure>\n    </testcase>",
                    escaped(failure),
                    escaped(&case.details)
                ),
            };
        }
        xml.push_str("  </testsuite>\n");
    }
    xml + "</testsuites>\n"
}
