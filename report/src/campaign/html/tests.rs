use super::text::escape;

#[test]
fn no_text_is_taken_for_markup() {
    assert_eq!(escape("<b a=\"1\" b='2'>&"), "&lt;b a=&quot;1&quot; b=&#39;2&#39;&gt;&amp;");
}
