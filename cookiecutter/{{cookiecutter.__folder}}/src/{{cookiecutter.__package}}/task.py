{% if cookiecutter.what != "pair" and "task" in cookiecutter.__kinds %}
{{ partial("task.py") -}}
{% endif %}
