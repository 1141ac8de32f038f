{% if cookiecutter.what == "pair" %}
{{ partial("task.py") -}}
{% endif %}
