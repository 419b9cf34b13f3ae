use eframe::egui::{Event, Key, Modifiers, PointerButton, RawInput, pos2};

use super::Paced;

fn key(key: Key, modifiers: Modifiers, pressed: bool) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
}

fn stroke(of: Key, modifiers: Modifiers) -> [Event; 2] {
    [key(of, modifiers, true), key(of, modifiers, false)]
}

fn letters(text: &str) -> Vec<Event> {
    let letter = |own: char| {
        let of = Key::from_name(&own.to_uppercase().to_string()).unwrap_or(Key::Space);
        [key(of, Modifiers::NONE, true), Event::Text(own.into()), key(of, Modifiers::NONE, false)]
    };
    text.chars().flat_map(letter).collect()
}

fn button(pressed: bool) -> Event {
    let (pos, button) = (pos2(3.0, 4.0), PointerButton::Primary);
    Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE }
}

/// What each frame takes, until nothing waits; `typing` says when a field has the focus.
fn frames(events: Vec<Event>, typing: impl Fn(usize) -> bool) -> Vec<Vec<Event>> {
    let mut paced = Paced::default();
    let mut input = RawInput { events, ..RawInput::default() };
    let mut frames = Vec::new();
    loop {
        let waits = paced.take(&mut input, typing(frames.len()));
        frames.push(std::mem::take(&mut input.events));
        if !waits {
            return frames;
        }
    }
}

#[test]
fn what_is_typed_after_a_key_waits_for_the_field_that_it_opens() {
    let opened = stroke(Key::P, Modifiers::COMMAND).to_vec();
    let (text, entered) = (letters("run"), stroke(Key::Enter, Modifiers::NONE).to_vec());
    let all = [opened.clone(), text.clone(), entered.clone()].concat();
    // The field is there from the second frame on.
    assert_eq!(frames(all, |frame| frame > 0), [opened, vec![], text, entered]);
}

#[test]
fn letters_that_do_something_go_one_by_one_with_their_text() {
    let (first, second) = (letters("g"), letters("z"));
    let all = [first.clone(), second.clone()].concat();
    assert_eq!(frames(all, |_| false), [first, vec![], second]);
}

#[test]
fn a_click_is_done_before_the_key_after_it() {
    let click = vec![Event::PointerMoved(pos2(3.0, 4.0)), button(true), button(false)];
    let twice = [click.clone(), click[1..].to_vec()].concat();
    let after = letters("n");
    let all = [twice.clone(), after.clone()].concat();
    assert_eq!(frames(all, |_| false), [twice, vec![], after]);
}

#[test]
fn a_button_is_released_in_the_frame_after_it_was_pressed() {
    let mut paced = Paced::default();
    for pressed in [true, false] {
        let mut input = RawInput { events: vec![button(pressed)], ..RawInput::default() };
        assert!(!paced.take(&mut input, false));
        assert_eq!(input.events, [button(pressed)]);
    }
}

#[test]
fn a_key_that_is_held_does_not_go_on_after_it_is_released() {
    let mut paced = Paced::default();
    let mut went = 0;
    // Twenty repetitions in each slow frame.
    for frame in 0..40 {
        let held = |pressed| key(Key::Tab, Modifiers::NONE, pressed);
        let events = match frame {
            0..10 => vec![held(true); 20],
            10 => vec![held(false)],
            _ => Vec::new(),
        };
        let mut input = RawInput { events, ..RawInput::default() };
        paced.take(&mut input, false);
        let presses = input.events.iter().filter(|own| **own == held(true)).count();
        assert!(presses <= 1 && (presses == 0 || frame <= 40), "frame {frame}");
        went += presses;
        if frame == 12 {
            assert!(!paced.take(&mut RawInput::default(), false), "nothing waits any more");
        }
    }
    assert!(went > 1, "a held key repeats");
}

#[test]
fn modifiers_change_when_their_keys_do() {
    let held = |modifiers| Event::ModifiersChanged(modifiers);
    let opened = [
        vec![held(Modifiers::COMMAND)],
        stroke(Key::P, Modifiers::COMMAND).to_vec(),
        vec![held(Modifiers::NONE)],
    ]
    .concat();
    let click = vec![button(true), button(false)];
    let again = opened.clone();
    let all = [opened.clone(), click.clone(), again.clone()].concat();
    // The click is without Ctrl, as the hand did it.
    let click = [click, vec![held(Modifiers::COMMAND)]].concat();
    let again = again[1..].to_vec();
    assert_eq!(frames(all, |_| false), [opened, vec![], click, vec![], again]);
}

#[test]
fn news_of_the_window_waits_for_nothing() {
    let news = vec![Event::PointerMoved(pos2(1.0, 1.0)), Event::WindowFocused(true)];
    let all = [news.clone(), stroke(Key::A, Modifiers::NONE).to_vec()].concat();
    assert_eq!(frames(all.clone(), |_| false), [all]);
    let mut paced = Paced::default();
    let mut input = RawInput { events: letters("a"), ..RawInput::default() };
    assert!(!paced.take(&mut input, false));
    input.events = news.clone();
    assert!(!paced.take(&mut input, false), "a frame without keys takes them");
    assert_eq!(input.events, news);
}
