#!/usr/bin/env bash
# Boots a small virtual machine with Debian's kernel and its GPIO simulator, and runs one command in it as root.
#
# usage: vm.sh CACHE FILES COMMAND...
#   CACHE    folder for the kernel and the modules, kept between runs
#   FILES    folder that becomes the machine's /t; COMMAND is run there
#
# The console is copied to stdout; the last line is `rc=N` with the command's exit code. Exit code: 0 the machine ran and
# shut down, whatever N is; 77 it cannot be had here, with the reason on stderr; others: it broke.
#
# No Debian kernel ships gpio-sim, so it is built out of tree from the source package of the very same kernel, with irq_sim,
# which it needs and which Debian does not build either. KVM is not needed.
set -euo pipefail
cache=$1 files=$(realpath "$2"); shift 2
mkdir -p "$cache"; cache=$(realpath "$cache")

cannot() { echo "no GPIO virtual machine here: $*" >&2; exit 77; }
for tool in qemu-system-x86_64 cpio gzip make gcc flock apt-get apt-cache dpkg-deb xz; do
    command -v "$tool" >/dev/null || cannot "$tool is missing (apt install qemu-system-x86 cpio kmod make gcc libelf-dev xz-utils)"
done
[ -x /bin/busybox ] && ! ldd /bin/busybox >/dev/null 2>&1 || cannot "a static busybox is missing (apt install busybox-static)"
kernel=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: linux-image-//p' | head -1)
[ -n "$kernel" ] || cannot "apt knows no package linux-image-amd64"
version=$(apt-cache policy "linux-image-$kernel" | sed -n 's/.*Candidate: //p')
series=$(echo "$kernel" | cut -d. -f1,2)
[ -d "/usr/src/linux-headers-$kernel" ] || cannot "the kernel's headers are missing (apt install linux-headers-$kernel)"

made=$cache/$kernel-$version
# Two machines may start at the same time; one of them builds.
exec 9> "$cache/lock"; flock 9
if [ ! -e "$made/done" ]; then
    echo "building the GPIO simulator for kernel $kernel $version" >&2
    rm -rf "$made"; mkdir -p "$made/m"; cd "$made"
    apt-get -qq download "linux-image-$kernel=$version" "linux-source-$series=$version" 2>/dev/null \
        || cannot "the packages linux-image-$kernel and linux-source-$series $version could not be downloaded"
    dpkg-deb --fsys-tarfile linux-image-*.deb | tar -x --wildcards "./boot/vmlinuz-$kernel" '*/fs/configfs/configfs.ko'
    dpkg-deb --fsys-tarfile linux-source-*.deb | tar -xO "./usr/src/linux-source-$series.tar.xz" \
        | tar -xJ -C m --strip-components=3 "linux-source-$series/drivers/gpio/gpio-sim.c" "linux-source-$series/drivers/gpio/gpiolib.h"
    dpkg-deb --fsys-tarfile linux-source-*.deb | tar -xO "./usr/src/linux-source-$series.tar.xz" \
        | tar -xJ -C m --strip-components=3 "linux-source-$series/kernel/irq/irq_sim.c"
    # irq_sim is meant to be built into the kernel: irq_to_desc is not there for modules, irq_data_to_desc is.
    sed -i -e 's/irq_to_desc(irqnum)/irq_data_to_desc(irq_get_irq_data(irqnum))/' \
        -e '0,/#include <linux\/irq_sim.h>/s//#include <linux\/irq.h>\n#include <linux\/irq_sim.h>/' m/irq_sim.c
    printf '#include <linux/module.h>\nMODULE_LICENSE("GPL");\n' >> m/irq_sim.c
    printf 'obj-m += gpio-sim.o irqsim.o\nirqsim-y := irq_sim.o\n' > m/Makefile
    make -s -C "/usr/src/linux-headers-$kernel" M="$made/m" modules >&2
    strip -g m/*.ko
    rm -f ./*.deb
    touch done
fi
exec 9>&-

root=$(mktemp -d); trap 'rm -rf "$root"' EXIT
mkdir -p "$root"/{bin,mod,dev,proc,sys,tmp,etc}
cp /bin/busybox "$root/bin/busybox"
cp "$(find "$made" -name configfs.ko)" "$root/mod/1.ko"
cp "$made/m/irqsim.ko" "$root/mod/2.ko"; cp "$made/m/gpio-sim.ko" "$root/mod/3.ko"
cp -a "$files" "$root/t"; chmod a+rX "$root" "$root/t" "$root"/t/*
printf '%q ' "$@" > "$root/t/.command"
cat > "$root/init" <<'I'
#!/bin/busybox sh
/bin/busybox mkdir -p /proc /sys /dev /tmp /usr/bin /sbin
/bin/busybox --install -s /bin
export PATH=/bin HOME=/tmp
mount -t proc p /proc; mount -t sysfs s /sys; mount -t devtmpfs d /dev; mount -t tmpfs t /tmp
ip link set lo up
for m in /mod/*.ko; do insmod $m; done
mount -t configfs c /sys/kernel/config
cd /t; sh ./.command; echo "rc=$?"
poweroff -f
I
chmod +x "$root/init"
(cd "$root"; find . | cpio -o -H newc --quiet | gzip -1) > "$root.gz"; trap 'rm -rf "$root" "$root.gz"' EXIT
timeout "${VM_TIMEOUT:-300}" qemu-system-x86_64 -accel tcg -cpu qemu64 -smp 1 -m 768 -nic none -display none -monitor none \
    -serial stdio -no-reboot -kernel "$made/boot/vmlinuz-$kernel" -initrd "$root.gz" \
    -append "console=ttyS0 panic=-1 oops=panic quiet tsc=nowatchdog" </dev/null | tr -d '\r'
