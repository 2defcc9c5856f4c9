//! The page of a campaign in a real browser: everything is drawn, nothing is requested, no error is logged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use lab_campaign::fly;
use lab_campaign::plan::Plan;
use lab_campaign::spec::SpecFile;
use lab_campaign::store::RunStore;

/// Jams of one effector, with what a text must not break: tags that end a script or keep it from ending, a formula.
const SPEC: &str = r#"
name = "small </script><b>jams</b>"
duration_s = 3.0
scenario = "nominal"

[[airframe]]
name = "tvc_jet"

[[airframe]]
name = "the same/at 100 m/s"

[set]
"plant.fault.1.kind" = "stuck_at"
"plant.fault.1.onset_s" = 0.5

[[vary]]
key = "plant.fault.1.effector"
values = ["rudder"]

[[vary]]
key = "plant.fault.1.angle_deg"
grid = { from = -1.0, to = 1.0, count = 5 }
as = "travel"

[[law]]
name = '=HYPERLINK("http://127.0.0.1/", "PID")'
about = "for the test"
set = { FTC_MODE = 0 }

[[law]]
name = "paper </script><!--<script>"
set = { FTC_MODE = 1 }
"#;

fn page(folder: &Path) -> PathBuf {
    let file = SpecFile::parse("small.toml", SPEC.to_owned(), PathBuf::new()).expect("a campaign");
    let plan = Plan::new(file).expect("a plan");
    let store = RunStore::open(&plan, folder).expect("a new folder");
    let _ = fly::fly(&plan, &store, None).expect("it can be written");
    lab_campaign::write(&plan, &store).expect("it can be written");
    folder.join("report.html")
}

#[test]
fn the_page_is_drawn_in_a_browser_without_a_request_or_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = page(folder.path());
    let html = fs::read_to_string(&page).expect("a page");
    // A name of an aircraft is no path.
    assert!(folder.path().join("the same-at 100 m-s-map.svg").is_file());
    // Survived, map, differences, nearest losses, of two aircraft; no letter of a stranger begins a tag or a comment.
    assert_eq!(html.matches("<svg ").count(), 8);
    assert!(!html.contains("<script") && !html.contains("<!--<") && !html.contains("<b>jams"));
    for name in ["summary.csv", "scores.csv"] {
        let table = fs::read_to_string(folder.path().join(name)).expect("a table");
        assert!(table.contains(",\"'=HYPERLINK(\"\"http://"), "{name}: {table}");
    }
    let browser = Process::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
        .arg("--virtual-time-budget=20000")
        .args(["--disable-background-networking", "--disable-component-update", "--no-first-run"])
        .args(["--enable-logging=stderr", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", page.display()))
        .output();
    let Ok(browser) = browser else {
        println!("SKIPPED: there is no chromium, so the page was not opened");
        return;
    };
    // Its policy forbids every request, and the browser would log the attempt.
    assert!(html.contains("default-src 'none'"), "the page has no policy");
    let log = String::from_utf8_lossy(&browser.stderr);
    let console: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "{console:?}");
    let dom = String::from_utf8_lossy(&browser.stdout);
    assert_eq!(dom.matches("<svg ").count(), 8, "charts drawn");
    assert!(dom.contains("small &lt;/script&gt;"), "the title is text");
    assert!(dom.contains("rudder jammed at"), "the map is drawn");
}
