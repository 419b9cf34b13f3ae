use std::ffi::OsString;

use super::can_be_asked;

#[test]
fn dialogs_need_a_session_bus_or_zenity() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().as_os_str().to_owned();
    let given = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let at = at.clone();
        can_be_asked(&move |name| names.iter().any(|given| given == name).then(|| at.clone()))
    };
    assert!(!given(&[]), "nothing is there");
    assert!(!given(&["PATH", "XDG_RUNTIME_DIR"]), "the folders are empty");
    assert!(given(&["DBUS_SESSION_BUS_ADDRESS"]));
    assert!(!can_be_asked(&|name| (name == "DBUS_SESSION_BUS_ADDRESS").then(OsString::new)));
    std::fs::write(folder.path().join("bus"), "").unwrap();
    assert!(given(&["XDG_RUNTIME_DIR"]));
    assert!(!given(&["PATH"]));
    std::fs::write(folder.path().join("zenity"), "").unwrap();
    assert!(given(&["PATH"]));
}
