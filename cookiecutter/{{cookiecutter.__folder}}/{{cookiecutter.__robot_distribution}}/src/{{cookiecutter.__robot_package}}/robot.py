{% if cookiecutter.what == "pair" %}
{{ partial("robot.py") -}}
{% endif %}
