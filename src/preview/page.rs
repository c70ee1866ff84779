//! The page, put together when the program is compiled: it asks for nothing from elsewhere.

/// The whole page.
pub const PAGE: &str = concat!(
    include_str!("page/head.html"),
    "<style>\n",
    include_str!("../compare/viewer/viewer.css"),
    include_str!("page/page.css"),
    "</style>\n</head>\n",
    include_str!("page/body.html"),
    "<script>\n",
    include_str!("../compare/viewer/viewer.js"),
    include_str!("page/picture.js"),
    include_str!("page/panels.js"),
    include_str!("page/page.js"),
    "</script>\n</body>\n</html>\n",
);
