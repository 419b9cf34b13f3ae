#!/usr/bin/env bash
# Makes a Debian package and a relocatable archive of lobelia: the program, stripped, with desktop entry,
# icons, the MIME type of projects, man pages, shell completions, the example, the guide and the
# licences of all crates.
#
#   assets/package.sh [FOLDER]          (default: out/package)
#
# Builds the program first, or takes LOBELIA=PROGRAM. Needs rsvg-convert (librsvg2-bin), objcopy (binutils), dpkg-deb
# and python3; with mdbook on the path the guide is HTML, else Markdown. The same sources and
# program give the same files, byte by byte. tests/package.sh tries them in a clean Debian.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'assets/package.sh: %s\n' "$*" >&2; exit 1; }
for tool in rsvg-convert objcopy objdump dpkg-deb python3 gzip; do
    command -v "$tool" >/dev/null || fail "$tool is missing (apt-get install librsvg2-bin binutils dpkg python3)"
done
out=$(mkdir -p "${1:-out/package}" && cd "${1:-out/package}" && pwd)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
architecture=$(dpkg --print-architecture)
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}
export SOURCE_DATE_EPOCH

[ -n "${LOBELIA:-}" ] || cargo build --release --locked
program=${LOBELIA:-target/release/lobelia}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tree=$work/tree
umask 022

# What both have, below one folder that can lie anywhere: the program looks for share/ beside bin/.
put() { install -D -m 644 "$1" "$tree/$2"; }
install -d "$tree/bin"
objcopy --strip-all "$program" "$tree/bin/lobelia"
chmod 755 "$tree/bin/lobelia"
put assets/package/lobelia.desktop share/applications/lobelia.desktop
put assets/package/lobelia.xml share/mime/packages/lobelia.xml
put assets/package/lobelia.svg share/icons/hicolor/scalable/apps/lobelia.svg
for size in 16 24 32 48 64 128 256 512; do
    icons=$tree/share/icons/hicolor/${size}x$size/apps
    mkdir -p "$icons"
    rsvg-convert -w "$size" -h "$size" assets/package/lobelia.svg -o "$icons/lobelia.png"
done
"$program" reference "$work/reference"
for page in "$work"/reference/man/*.1; do
    put "$page" "share/man/man1/$(basename "$page")"
done
gzip -9n "$tree"/share/man/man1/*.1
put "$work/reference/bash/lobelia" share/bash-completion/completions/lobelia
put "$work/reference/zsh/_lobelia" share/zsh/vendor-completions/_lobelia
put "$work/reference/fish/lobelia.fish" share/fish/vendor_completions.d/lobelia.fish
mkdir -p "$tree/share/lobelia/examples" "$tree/share/doc/lobelia/guide"
cp -r assets/examples/corner "$tree/share/lobelia/examples/corner"
if command -v mdbook >/dev/null; then
    mdbook build --dest-dir "$tree/share/doc/lobelia/guide" assets/guide
else
    cp -r assets/guide/*.md assets/guide/pictures "$tree/share/doc/lobelia/guide"
fi
assets/licences.py "$tree/share/doc/lobelia/LICENCES-of-crates.txt"
gzip -9n "$tree/share/doc/lobelia/LICENCES-of-crates.txt"
{
    cat LICENSE
    printf '\nThe photographs building-*.jpg in the guide are under another licence:\n\n'
    cat assets/guide/pictures/building-NOTICE.txt
    printf '\nThe letters of charts are Ubuntu Light, under the Ubuntu Font Licence:\n\n'
    cat assets/fonts/UFL.txt
} >"$work/copyright"
put "$work/copyright" share/doc/lobelia/copyright
put CHANGELOG.md share/doc/lobelia/CHANGELOG.md
chmod -R u+w,go-w,a+rX "$tree"
find "$tree/share" -type f -exec chmod 644 {} +

# The archive.
name=lobelia-$version-$(uname -m)-linux
mv "$tree" "$work/$name"
cat >"$work/$name/README.txt" <<TEXT
lobelia $version. Unpack it anywhere and start bin/lobelia; nothing else has to be done.
The studio needs X11 or Wayland and a Vulkan or OpenGL driver. On Debian:
  sudo apt-get install libvulkan1 mesa-vulkan-drivers libxkbcommon-x11-0 libxcursor1 libxi6
To find it in menus, copy bin/ and share/ into ~/.local (or /usr/local).
share/doc/lobelia holds the guide and the licences.
TEXT
tar -C "$work" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" -cf - "$name" |
    gzip -9n >"$out/$name.tar.gz"

# The Debian package.
root=$work/root
mkdir -p "$root/DEBIAN"
mv "$work/$name" "$root/usr"
rm "$root/usr/README.txt"
gzip -9nc CHANGELOG.md >"$root/usr/share/doc/lobelia/changelog.gz"
rm "$root/usr/share/doc/lobelia/CHANGELOG.md"
libc=$(objdump -T "$root/usr/bin/lobelia" | sed -n 's/.*(\?GLIBC_\([0-9.]*\).*/\1/p' | sort -V | tail -1)
cat >"$root/DEBIAN/control" <<TEXT
Package: lobelia
Version: $version-1
Architecture: $architecture
Maintainer: The lobelia developers <lobelia@localhost>
Installed-Size: $(du -sk "$root/usr" | cut -f1)
Depends: libc6 (>= $libc), libgcc-s1
Recommends: libvulkan1, mesa-vulkan-drivers | vulkan-icd, libgl1-mesa-dri, libegl1, libx11-6, libx11-xcb1, libxcb1, libxcursor1, libxi6, libxrender1, libxkbcommon0, libxkbcommon-x11-0, libwayland-client0, libdbus-1-3, libfontconfig1
Suggests: xdg-desktop-portal, fonts-noto-cjk
Section: graphics
Priority: optional
Description: photometric reconstruction from photographs and partial geometry
 From a partial geometric model, calibrated cameras and HDR photographs, lobelia
 recovers what the surfaces reflect and what light falls on them, so that the
 scene can be relit and objects set into it.
 .
 The terminal commands need nothing else; the recommended packages open the
 window.
TEXT
(cd "$root" && find usr -type f -print0 | sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
find "$root" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
deb=lobelia_$version-1_$architecture.deb
dpkg-deb --root-owner-group --build "$root" "$out/$deb" >/dev/null
ls -l "$out/$name.tar.gz" "$out/$deb"
