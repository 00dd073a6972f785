FROM python:3.11-slim-bookworm AS build
RUN python -m venv /opt/spinewatch
COPY requirements.lock /src/
RUN /opt/spinewatch/bin/pip install --no-cache-dir --require-hashes --requirement /src/requirements.lock
COPY pyproject.toml README.md /src/
COPY spinewatch /src/spinewatch
COPY contract /src/contract
COPY exports /src/exports
COPY reports /src/reports
COPY settings /src/settings
COPY store /src/store
COPY workers /src/workers
COPY service /src/service
COPY commands /src/commands
COPY migrations /src/migrations
COPY samples /src/samples
RUN /opt/spinewatch/bin/pip install --no-cache-dir --no-deps /src[dicom,pdf]
# spinewatch sbom takes the hashes from here
RUN install -D --mode 0644 /src/requirements.lock /opt/spinewatch/share/spinewatch/requirements.lock

FROM python:3.11-slim-bookworm
# hadolint ignore=DL3008 - the security updates of the release, whatever their number
RUN apt-get update \
    && apt-get install -y --no-install-recommends libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0 fonts-dejavu-core \
    && rm -rf /var/lib/apt/lists/*
RUN useradd --system --no-log-init --uid 10001 --home-dir /data spinewatch \
    && install -d -o spinewatch -m 0700 /data
COPY --from=build /opt/spinewatch /opt/spinewatch
# the root may be read-only: only /data and /tmp are written
ENV PATH=/opt/spinewatch/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    TMPDIR=/tmp \
    XDG_CACHE_HOME=/tmp \
    SPINEWATCH_DATABASE_URL=sqlite:////data/spinewatch.sqlite
USER spinewatch
WORKDIR /data
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/health/live', timeout=2)"]
CMD ["spinewatch", "run", "--host", "0.0.0.0", "--behind-proxy"]
