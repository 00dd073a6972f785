FROM python:3.11-slim-bookworm AS build
RUN python -m venv /opt/spinewatch
COPY requirements.lock /src/
RUN /opt/spinewatch/bin/pip install --no-cache-dir --require-hashes --requirement /src/requirements.lock
COPY pyproject.toml README.md /src/
COPY spinewatch /src/spinewatch
COPY contract /src/contract
COPY reports /src/reports
COPY settings /src/settings
COPY store /src/store
COPY workers /src/workers
COPY service /src/service
COPY commands /src/commands
COPY migrations /src/migrations
RUN /opt/spinewatch/bin/pip install --no-cache-dir --no-deps /src

FROM python:3.11-slim-bookworm
RUN useradd --system --uid 10001 --home-dir /data spinewatch && install -d -o spinewatch /data
COPY --from=build /opt/spinewatch /opt/spinewatch
ENV PATH=/opt/spinewatch/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    SPINEWATCH_DATABASE_URL=sqlite:////data/spinewatch.sqlite
USER spinewatch
WORKDIR /data
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/v1/health', timeout=2)"]
CMD ["spinewatch", "run", "--host", "0.0.0.0"]
