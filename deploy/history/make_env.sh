#!/bin/sh
# Makes history.env beside docker-compose.yml: passwords and token of the history, drawn by lot. Run it once.
set -eu
file="$(dirname "$0")/../../history.env"
if [ -e "$file" ]; then
  echo "history.env is there already, and the databases know what is in it" >&2
  exit 1
fi
drawn() { od -An -N24 -tx1 /dev/urandom | tr -d ' \n'; }
umask 077
influx="$(drawn)" token="$(drawn)" grafana="$(drawn)"
cat > "$file.tmp" <<END
DOCKER_INFLUXDB_INIT_PASSWORD=$influx
DOCKER_INFLUXDB_INIT_ADMIN_TOKEN=$token
INFLUX_TOKEN=$token
GF_SECURITY_ADMIN_PASSWORD=$grafana
END
mv "$file.tmp" "$file"
echo "history.env is made; Grafana's user is admin, the password is the line GF_SECURITY_ADMIN_PASSWORD"
