//! What a film says of its making as an XMP packet: an RDF description whose text is the metadata, a line each.

use super::super::Metadata;
use super::spec::{lines_of, metadata_of};

const BEFORE: &str = "<dc:description><rdf:Alt><rdf:li xml:lang=\"x-default\">";
const AFTER: &str = "</rdf:li></rdf:Alt></dc:description>";

pub fn packet(metadata: &Metadata) -> String {
    let text = lines_of(metadata).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // A carriage return, and what XML cannot hold at all, would not come back.
    let text: String = text.chars().filter(|c| !c.is_control() || *c == '\n').collect();
    format!(
        "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?><x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\
         <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" \
         xmlns:dc=\"http://purl.org/dc/elements/1.1/\">{BEFORE}{text}{AFTER}</rdf:Description></rdf:RDF></x:xmpmeta>\
         <?xpacket end=\"r\"?>"
    )
}

/// The metadata of a packet; none if it is not one of ours.
pub fn metadata_in(packet: &str) -> Metadata {
    let text = packet.split_once(BEFORE).and_then(|(_, rest)| rest.split_once(AFTER)).map_or("", |(text, _)| text);
    metadata_of(&text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_come_back_whatever_is_in_them() {
        let metadata =
            vec![("Source".to_string(), "a < b & \u{e4}&lt;.rhai".to_string()), ("Hash".into(), "12".into())];
        assert_eq!(metadata_in(&packet(&metadata)), metadata);
        assert_eq!(metadata_in("<x/>"), Metadata::new());
    }
}
