{% if cookiecutter.what == "algorithm" %}
{{ algorithm(cookiecutter.name) -}}
{% endif %}
