{% if cookiecutter.what == "algorithm" %}
{{ plain("my_algorithm.py", "my_algorithm", cookiecutter.name) -}}
{% endif %}
