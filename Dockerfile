# From Debian's packages alone: docker build -t trocar .     docker run --rm -v "$PWD:/work" -w /work trocar run SCENE --out out
# Apptainer takes the same image: apptainer build trocar.sif docker-daemon://trocar:latest
FROM debian:bookworm
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates
COPY . /opt/trocar
RUN cd /opt/trocar && ./start build && ln -s /opt/trocar/build/release/trocar /usr/local/bin/trocar && trocar --version
ENTRYPOINT ["trocar"]
