#!/bin/sh
# Certificates for a broker and its clients, from an authority of their own (docs/mqtt.md, "Who may").
# usage: sh deploy/make_certificates.sh DIRECTORY HOST CLIENT...
#   HOST     name or address at which the clients reach the broker
#   CLIENT   a user of deploy/mosquitto.acl: controller, operator, engineer, display, reconcile
# What is there already is kept, so that a client can be added later. Keys are readable for their owner only;
# ca.key makes certificates: keep it elsewhere than on the broker.
set -eu
umask 077
[ $# -ge 3 ] || { sed -n '3,5p' "$0" >&2; exit 2; }
directory=$1 host=$2
shift 2
mkdir -p "$directory"
cd "$directory"
days=${DAYS:-825}

made() {  # name, common name, extensions
    [ -e "$1.pem" ] && return 0
    openssl req -new -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout "$1.key" -out "$1.csr" \
        -subj "/CN=$2" 2>/dev/null
    printf 'basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n%s\n' "$3" >"$1.ext"
    openssl x509 -req -in "$1.csr" -CA ca.pem -CAkey ca.key -CAcreateserial -days "$days" -extfile "$1.ext" \
        -out "$1.pem" 2>/dev/null
    rm -f "$1.csr" "$1.ext"
    echo "$directory/$1.pem"
}

if [ ! -e ca.pem ]; then
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout ca.key -out ca.pem \
        -days "$((2 * days))" -subj "/CN=servo broker authority" \
        -addext "basicConstraints=critical,CA:TRUE,pathlen:0" -addext "keyUsage=critical,keyCertSign,cRLSign" 2>/dev/null
    echo "$directory/ca.pem"
fi
case $host in
*[!0-9.:a-fA-F]*) name="DNS:$host" ;;
*:* | *.*) name="IP:$host" ;;
*) name="DNS:$host" ;;
esac
made broker "$host" "extendedKeyUsage=serverAuth
subjectAltName=$name"
for client in "$@"; do
    case $client in
    broker | ca | *[!A-Za-z0-9_.-]*) echo "$client is not a name for a client" >&2; exit 2 ;;
    esac
    made "$client" "$client" "extendedKeyUsage=clientAuth"
done
