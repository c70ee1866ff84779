use super::*;
use crate::compare::judge::{FlipSettings, judge};
use crate::output::{ChannelSamples, ColorEncoding, PictureChannel, PicturePart, PixelWindow};

fn picture(encoding: ColorEncoding, names: &[&str], value: f32) -> LayeredPicture {
    let window = PixelWindow { origin: [0, 0], size: [3, 2] };
    let channel =
        |name: &&str| PictureChannel { name: name.to_string(), samples: ChannelSamples::Float(vec![value; 6]) };
    let part = PicturePart { name: None, data_window: window, channels: names.iter().map(channel).collect() };
    LayeredPicture { encoding, display_window: window, parts: vec![part] }
}

fn item(a: &LayeredPicture, b: &LayeredPicture) -> ReportItem {
    let judged = judge(a, b, &[], FlipSettings::default(), true);
    ReportItem { id: "show.0003".into(), status: "different", is_acceptable: true, ..ReportItem::default() }
        .with_pictures(Some(a), Some(b), Some(&judged))
}

#[test]
fn a_page_is_whole_and_loads_nothing() {
    let encoding = ColorEncoding::Srgb { bits: 8 };
    let (a, b) = (picture(encoding, &["R", "G", "B"], 0.2), picture(encoding, &["R", "G", "B"], 0.4));
    let mut hostile = item(&a, &b);
    hostile.lines.push("</script><script>alert(1)</script>".into());
    hostile.why.push(SceneChange { what: "<b>".into(), before: Some("{{data}}".into()), after: Some("&".into()) });
    let page = ReportPage {
        title: "a <title>".into(),
        names: ["golden", "now"],
        command: Some("anim test".into()),
        items: vec![hostile],
        ..ReportPage::default()
    };
    let html = page.to_html();
    assert_eq!(html, page.to_html());
    assert!(html.starts_with("<!doctype html>") && html.contains("a &lt;title&gt;"));
    assert_eq!(html.matches("</script>").count(), 2, "texts end no script");
    assert!(!html.replace("{{data}}", "").contains("{{"), "a place of the template was left");
    assert!(
        !html.contains("http:") && !html.contains("https:") && !html.contains("src="),
        "it names something elsewhere"
    );
    assert_eq!(html.matches("data:image/png;base64,").count(), 3, "golden, now and FLIP");
    let data = html.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
    let data: Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["items"][0]["why"][0]["before"], "{{data}}");
}

#[test]
fn channels_that_differ_are_shown_and_others_are_not() {
    let names = ["R", "G", "B", "Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"];
    let a = picture(ColorEncoding::Linear, &names, 0.5);
    let mut b = a.clone();
    let shown = |b: &LayeredPicture| -> Vec<String> {
        item(&a, b).views.iter().map(|view| view["name"].as_str().unwrap().to_string()).collect()
    };
    assert_eq!(shown(&b), [""]);
    b.parts[0].channels[3].samples = ChannelSamples::Float(vec![9.0; 6]);
    b.parts[0].channels[8].samples = ChannelSamples::Float(vec![9.0; 6]);
    assert_eq!(shown(&b), ["", "albedo", "Z"]);
    b.parts[0].channels.remove(4);
    assert_eq!(shown(&b), ["", "albedo", "Z", "N.X"]);
    let views = item(&a, &b).views;
    assert!(views[0]["a"]["floats"].is_string() && views[0]["flip"]["png"].is_string());
    assert!(views[3]["b"].is_null() && views[3]["a"]["planes"] == 1);
}

#[test]
fn junit_is_xml_with_counts() {
    let case = |suite: &str, name: &str, failure: Option<&str>| JunitCase {
        suite: suite.into(),
        name: name.into(),
        failure: failure.map(str::to_string),
        details: "entity `a` <- \"b\" & \u{1}".into(),
    };
    let cases = [case("show", "0001", None), case("show", "0002", Some("2 < 3")), case("lens", "0001", None)];
    let xml = junit("golden.ron", &cases);
    assert!(xml.contains("<testsuites name=\"golden.ron\" tests=\"3\" failures=\"1\" errors=\"0\">"));
    assert!(xml.contains("<testsuite name=\"show\" tests=\"2\" failures=\"1\""));
    assert!(xml.contains("<failure message=\"2 &lt; 3\">entity `a` &lt;- &quot;b&quot; &amp;  </failure>"), "{xml}");
    assert_eq!(xml.matches("<testcase").count(), 3);
}
